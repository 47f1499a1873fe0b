//! A gesture stage for Deixis in Rust: subscribes to tracks, publishes gestures, and says how it fares.
//!
//! The rule is in `pointing.rs` and knows nothing of Zenoh; what the contract asks of a stage is here.

mod age;
mod contract;
mod place;
mod pointing;
mod voice;

use contract::{
    decode, encode, CameraInfo, Gestures, Health, InputHealth, OutputHealth, Tracks, STAGE,
};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use zenoh::handlers::RingChannel;
use zenoh::pubsub::Publisher;
use zenoh::sample::Sample;
use zenoh::Wait;

type Failure = Box<dyn std::error::Error + Send + Sync>;

const USAGE: &str = "usage: gesture_rust --robot NAME [--connect ENDPOINT]";
const TURN: Duration = Duration::from_millis(20);
const BEAT: Duration = Duration::from_secs(1);
const COMPLAIN_EVERY: Duration = Duration::from_secs(10);
const EXIT_UNREACHABLE: i32 = 69;

/// What the stage knows of itself.
struct Stage<'a> {
    instance: String,
    host: String,
    began: Instant,
    beats: u64,
    input: InputHealth,
    output: OutputHealth,
    lockstep: bool,
    age: age::RelativeAge,
    pointing: pointing::Pointing,
    complained: Option<Instant>,
    gestures: Publisher<'a>,
    aside: Publisher<'a>,
    place: place::Place,
}

impl Stage<'_> {
    /// Answer a frame; a message that breaks the contract is counted and said, one that is too old is counted.
    fn take(&mut self, sample: &Sample) -> Result<(), Failure> {
        self.input.received += 1;
        let received_ns = self.began.elapsed().as_nanos();
        let payload = sample.payload().to_bytes();
        let tracks: Tracks =
            match decode(&sample.encoding().to_string(), contract::TRACKS, &payload) {
                Ok(tracks) => tracks,
                Err(why) => {
                    self.reject(why);
                    return Ok(());
                }
            };
        // In lockstep the frames wait for us, and stamps are the time of the pictures.
        if self.age.age_s(tracks.run, tracks.stamp_ns, received_ns) > contract::MAX_AGE_S
            && !self.lockstep
        {
            self.input.too_old += 1;
            return Ok(());
        }
        self.input.used += 1;
        self.input.producers = vec![format!("{}/{}", tracks.stage, tracks.instance)];
        let gestures = self.pointing.update(&tracks);
        let (run, seq, stamp_ns) = (tracks.run, tracks.seq, tracks.stamp_ns);
        let answer = Gestures {
            run,
            seq,
            stamp_ns,
            stage: STAGE,
            instance: &self.instance,
            gestures,
        };
        if self.place.is_ours((run, seq)) {
            self.gestures.put(encode(&answer)).wait()?;
            self.output.published += 1;
        } else {
            self.aside.put(encode(&answer)).wait()?;
        }
        Ok(())
    }

    /// The camera says whether the frames wait for us.
    fn hear_camera(&mut self, info: &Sample) {
        let (label, payload) = (info.encoding().to_string(), info.payload().to_bytes());
        if let Ok(known) = decode::<CameraInfo>(&label, contract::CAMERA_INFO, &payload) {
            self.lockstep = known.lockstep;
        }
    }

    fn reject(&mut self, why: String) {
        self.input.rejected += 1;
        if self
            .complained
            .map_or(true, |at| at.elapsed() > COMPLAIN_EVERY)
        {
            eprintln!("gesture_rust: {}: rejected: {why}", self.input.key);
            self.complained = Some(Instant::now());
        }
        self.input.last_error = why.chars().take(500).collect();
    }

    fn health(&self) -> Vec<u8> {
        encode(&Health {
            stamp_ns: now_ns(),
            stage: STAGE,
            instance: &self.instance,
            count: self.beats,
            state: "ok",
            pid: std::process::id(),
            host: &self.host,
            uptime_s: self.began.elapsed().as_secs_f64(),
            cpu_s: proc_fields("/proc/self/stat", &[13, 14])
                .iter()
                .sum::<f64>()
                / 100.0,
            rss_mb: proc_fields("/proc/self/statm", &[1]).iter().sum::<f64>() * 4096.0 / 1e6,
            inputs: [self.input.clone()],
            outputs: [self.output.clone()],
            standing_by: self.place.state() != "speaks",
        })
    }
}

/// Wall clock, Unix nanoseconds.
fn now_ns() -> u64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos() as u64)
}

fn main() {
    let Some((robot, endpoint)) = arguments() else {
        eprintln!("{USAGE}");
        std::process::exit(2);
    };
    let session = match zenoh::open(client(&endpoint)).wait() {
        Ok(session) => session,
        Err(error) => {
            eprintln!("gesture_rust: no Zenoh router answers at {endpoint} (--connect): {error}");
            std::process::exit(EXIT_UNREACHABLE);
        }
    };
    if let Err(error) = serve(&session, &robot) {
        eprintln!("gesture_rust: stopped by a fault: {error}");
        std::process::exit(1);
    }
}

fn serve(session: &zenoh::Session, robot: &str) -> Result<(), Failure> {
    let stopping = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        signal_hook::flag::register(signal, Arc::clone(&stopping))?;
    }
    let key = |path: &str| format!("deixis/{robot}/{path}");
    let health_key = key("gesture/health");
    // Rings keep the newest: whoever is slow works on what is new and never on a backlog.
    let tracks = session
        .declare_subscriber(key("tracker/tracks"))
        .with(RingChannel::new(1))
        .wait()?;
    let infos = session
        .declare_subscriber(key("camera/info"))
        .with(RingChannel::new(1))
        .wait()?;
    let asked = session
        .declare_queryable(&health_key)
        .with(RingChannel::new(8))
        .wait()?;
    let beat = session
        .declare_publisher(&health_key)
        .encoding(contract::HEALTH)
        .wait()?;
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname")
        .unwrap_or_default()
        .trim()
        .to_string();
    let instance = format!("rust-{}", std::process::id());
    let stands_by = !matches!(
        std::env::var("DEIXIS_STAND_BY").as_deref(),
        Err(_) | Ok("") | Ok("0")
    );
    let mut voice = voice::Voice::new(session, robot, &instance)?;
    let mut stage = Stage {
        instance,
        host,
        began: Instant::now(),
        beats: 0,
        input: InputHealth {
            key: key("tracker/tracks"),
            ..Default::default()
        },
        output: OutputHealth {
            key: key("gesture/gestures"),
            ..Default::default()
        },
        lockstep: false,
        age: age::RelativeAge::new(),
        pointing: pointing::Pointing::default(),
        complained: None,
        gestures: session
            .declare_publisher(key("gesture/gestures"))
            .encoding(contract::GESTURES)
            .wait()?,
        aside: session
            .declare_publisher(key("@standby/gesture/gestures"))
            .encoding(contract::GESTURES)
            .wait()?,
        place: place::Place::new(stands_by),
    };
    // It is published on change only; who comes later asks for it.
    let replies = session
        .get(key("camera/info"))
        .timeout(Duration::from_secs(1))
        .wait()?;
    while let Ok(reply) = replies.recv() {
        if let Ok(info) = reply.result() {
            stage.hear_camera(info);
        }
    }
    voice.hold_token(&stage.place)?;
    let mut due = Instant::now();
    while !stopping.load(Ordering::Relaxed) && !voice.leaving {
        let sample = tracks.recv_timeout(TURN)?;
        if let Some(info) = infos.try_recv()? {
            stage.hear_camera(&info);
        }
        if let Some(sample) = sample {
            stage.take(&sample)?;
        }
        voice.answer(&mut stage.place)?;
        while let Some(query) = asked.try_recv()? {
            query
                .reply(&health_key, stage.health())
                .encoding(contract::HEALTH)
                .wait()?;
        }
        if Instant::now() >= due {
            due = Instant::now() + BEAT;
            stage.beats += 1;
            beat.put(stage.health()).wait()?;
        }
    }
    Ok(())
}

/// A client of the router at the endpoint: it finds nobody by itself.
fn client(endpoint: &str) -> zenoh::Config {
    let mut config = zenoh::Config::default();
    let settings = [
        ("mode", "\"client\"".to_string()),
        ("connect/endpoints", format!("[{endpoint:?}]")),
        ("connect/timeout_ms", "2000".to_string()),
        ("connect/exit_on_failure", "true".to_string()),
        ("scouting/multicast/enabled", "false".to_string()),
    ];
    for (path, value) in settings {
        config
            .insert_json5(path, &value)
            .expect("settings of Zenoh 1.10");
    }
    config
}

/// The robot's name and the router's endpoint.
fn arguments() -> Option<(String, String)> {
    let (mut robot, mut endpoint) = (None, "tcp/127.0.0.1:7447".to_string());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--robot" => robot = words.next(),
            "--connect" => endpoint = words.next()?,
            _ => return None,
        }
    }
    Some((robot?, endpoint))
}

/// Numbers of a file of /proc by their places from 0; none where it does not tell.
fn proc_fields(path: &str, places: &[usize]) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    // The name of the program stands in brackets and may hold blanks: what follows it counts.
    let (skipped, rest) = text
        .rsplit_once(") ")
        .map_or((0, text.as_str()), |(_, rest)| (2, rest));
    let fields: Vec<&str> = rest.split_whitespace().collect();
    places
        .iter()
        .filter_map(|place| fields.get(place - skipped)?.parse().ok())
        .collect()
}
