//! The part of the contract that this stage needs (docs/contract.md): messages, labels, keys.

use serde::{Deserialize, Serialize};

pub const STAGE: &str = "gesture";
pub const TRACKS: &str = "application/msgpack;Tracks/2";
pub const CAMERA_INFO: &str = "application/msgpack;CameraInfo/1";
pub const GESTURES: &str = "application/msgpack;Gestures/2";
pub const HEALTH: &str = "application/msgpack;Health/1";
pub const VOICE: &str = "application/msgpack;Voice/1";
pub const MAX_AGE_S: f64 = 1.0;
pub const MAX_BYTES: usize = 1 << 20;

/// What is read of `tracker/tracks`; unknown fields are ignored.
#[derive(Deserialize)]
pub struct Tracks {
    pub run: u64,
    pub seq: u64,
    pub stamp_ns: u64,
    pub stage: String,
    pub instance: String,
    #[serde(default)]
    pub tracks: Vec<Track>,
}

#[derive(Deserialize)]
pub struct Track {
    pub person_id: Option<u64>,
    pub kind: String,
    pub centroid_px: [f64; 2],
    /// x, y of the top left corner, width, height; of a face the width is ear to ear.
    pub bbox_px: [f64; 4],
}

/// What is read of `camera/info`.
#[derive(Deserialize)]
pub struct CameraInfo {
    #[serde(default)]
    pub lockstep: bool,
}

#[derive(Serialize)]
pub struct Gestures<'a> {
    pub run: u64,
    pub seq: u64,
    pub stamp_ns: u64,
    pub stage: &'a str,
    pub instance: &'a str,
    pub gestures: Vec<Gesture>,
}

#[derive(Serialize)]
pub struct Gesture {
    pub person_id: u64,
    pub phase: &'static str,
    pub gesture: &'static str,
    pub hand: Option<&'static str>,
}

impl Gesture {
    pub fn idle(person_id: u64) -> Self {
        Self {
            person_id,
            phase: "idle",
            gesture: "none",
            hand: None,
        }
    }

    /// `kind` is the hand's track's: left and right are the person's own.
    pub fn of(person_id: u64, phase: &'static str, gesture: &'static str, kind: &str) -> Self {
        let hand = match kind {
            "left_hand" => Some("left"),
            "right_hand" => Some("right"),
            _ => None,
        };
        Self {
            person_id,
            phase,
            gesture,
            hand,
        }
    }
}

/// What is said to a get of `gesture/voice/{instance}`.
#[derive(Serialize)]
pub struct Voice<'a> {
    pub stamp_ns: u64,
    pub stage: &'a str,
    pub instance: &'a str,
    pub state: &'static str,
    pub other: &'a str,
    pub run: Option<u64>,
    pub seq: Option<u64>,
}

/// What is read of the answer of the one that is heard.
#[derive(Deserialize)]
pub struct Named {
    pub run: Option<u64>,
    pub seq: Option<u64>,
}

#[derive(Serialize)]
pub struct Health<'a> {
    pub stamp_ns: u64,
    pub stage: &'a str,
    pub instance: &'a str,
    pub count: u64,
    pub state: &'static str,
    pub pid: u32,
    pub host: &'a str,
    pub uptime_s: f64,
    pub cpu_s: f64,
    pub rss_mb: f64,
    pub inputs: [InputHealth; 1],
    pub outputs: [OutputHealth; 1],
    pub standing_by: bool,
}

#[derive(Clone, Default, Serialize)]
pub struct InputHealth {
    pub key: String,
    pub received: u64,
    pub used: u64,
    pub too_old: u64,
    pub rejected: u64,
    pub last_error: String,
    pub producers: Vec<String>,
}

#[derive(Clone, Default, Serialize)]
pub struct OutputHealth {
    pub key: String,
    pub published: u64,
}

/// Read a payload. The error names the cause.
pub fn decode<'a, T: Deserialize<'a>>(
    label: &str,
    expected: &str,
    payload: &'a [u8],
) -> Result<T, String> {
    if label != expected {
        return Err(format!("labelled '{label}', expected '{expected}'"));
    }
    if payload.len() > MAX_BYTES {
        return Err(format!(
            "{} bytes, more than the {MAX_BYTES} allowed",
            payload.len()
        ));
    }
    rmp_serde::from_slice(payload).map_err(|error| error.to_string())
}

/// As a msgpack map.
pub fn encode<T: Serialize>(message: &T) -> Vec<u8> {
    rmp_serde::to_vec_named(message).expect("plain data can be packed")
}
