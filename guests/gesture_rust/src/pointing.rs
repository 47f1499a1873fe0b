//! Which hand points where, by where it is held beside the face. Pure: tracks in, gestures out.
//!
//! A rule of thumb, and not what Deixis' own gesture stage does: a hand that is held still, as far from the face as an arm
//! that is stretched sideways holds it, points to that side.

use crate::contract::{Gesture, Track, Tracks};
use std::collections::HashMap;

/// In face widths: how far sideways, and how far below the face at most.
const STRETCHED: f64 = 1.3;
const LOWEST: f64 = 2.2;
/// In face widths a frame: what counts as still, and for how many frames before it is a stroke.
const STILL: f64 = 0.06;
const STILL_FRAMES: u32 = 4;

/// What is remembered of the raised hand of one person, from frame to frame.
struct Raised {
    at: (f64, f64),
    still_frames: u32,
}

/// Follows the hands of all persons of one run.
#[derive(Default)]
pub struct Pointing {
    run: Option<u64>,
    raised: HashMap<u64, Raised>,
}

impl Pointing {
    /// The gesture of each person with a face, in the order of their ids.
    pub fn update(&mut self, tracks: &Tracks) -> Vec<Gesture> {
        if self.run != Some(tracks.run) {
            self.run = Some(tracks.run);
            self.raised.clear(); // the camera began anew: other people, or the same elsewhere
        }
        let mut faces: Vec<(u64, &Track)> = (tracks.tracks.iter())
            .filter(|track| track.kind == "face")
            .filter_map(|track| Some((track.person_id?, track)))
            .collect();
        faces.sort_by_key(|(person, _)| *person);
        self.raised
            .retain(|person, _| faces.iter().any(|(known, _)| known == person));
        faces
            .iter()
            .map(|(person, face)| self.of_person(*person, face, tracks))
            .collect()
    }

    fn of_person(&mut self, person: u64, face: &Track, tracks: &Tracks) -> Gesture {
        let hands = tracks
            .tracks
            .iter()
            .filter(|track| track.person_id == Some(person) && track.kind != "face");
        let raised = hands
            .filter_map(|hand| Some((hand, beside(face, hand)?)))
            .find(|(_, at)| is_stretched(*at));
        let Some((hand, at)) = raised else {
            self.raised.remove(&person);
            return Gesture::idle(person);
        };
        let before = self.raised.get(&person);
        let still =
            before.is_some_and(|known| (known.at.0 - at.0).hypot(known.at.1 - at.1) < STILL);
        let still_frames = if still {
            before.map_or(0, |known| known.still_frames) + 1
        } else {
            0
        };
        self.raised.insert(person, Raised { at, still_frames });
        if still_frames < STILL_FRAMES {
            return Gesture::of(person, "preparation", "none", &hand.kind);
        }
        // The image's right is the person's own left.
        Gesture::of(
            person,
            "stroke",
            if at.0 > 0.0 {
                "point_left"
            } else {
                "point_right"
            },
            &hand.kind,
        )
    }
}

/// Where the hand is from the middle of the face, x to the image's right and y down, in face widths.
fn beside(face: &Track, hand: &Track) -> Option<(f64, f64)> {
    let width = face.bbox_px[2];
    (width > 0.0).then(|| {
        (
            (hand.centroid_px[0] - face.centroid_px[0]) / width,
            (hand.centroid_px[1] - face.centroid_px[1]) / width,
        )
    })
}

fn is_stretched(at: (f64, f64)) -> bool {
    at.0.abs() > STRETCHED && at.1 < LOWEST
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(kind: &str, x: f64, y: f64) -> Track {
        Track {
            person_id: Some(7),
            kind: kind.into(),
            centroid_px: [x, y],
            bbox_px: [x, y, 40.0, 50.0],
        }
    }

    fn frame(run: u64, hand_x: f64) -> Tracks {
        let tracks = vec![
            track("face", 300.0, 100.0),
            track("left_hand", hand_x, 150.0),
        ];
        Tracks {
            run,
            seq: 0,
            stamp_ns: 0,
            stage: "tracker".into(),
            instance: "t".into(),
            tracks,
        }
    }

    fn after(frames: &[Tracks]) -> Gesture {
        let mut pointing = Pointing::default();
        frames
            .iter()
            .map(|frame| pointing.update(frame).remove(0))
            .last()
            .unwrap()
    }

    #[test]
    fn a_hand_held_still_beside_the_face_points_to_its_side() {
        let held: Vec<Tracks> = (0..6).map(|_| frame(1, 400.0)).collect();
        assert_eq!(
            (after(&held).phase, after(&held).gesture),
            ("stroke", "point_left")
        );
        let other: Vec<Tracks> = (0..6).map(|_| frame(1, 200.0)).collect();
        assert_eq!(after(&other).gesture, "point_right");
    }

    #[test]
    fn a_hand_that_moves_prepares_and_one_at_the_body_is_idle() {
        let moving: Vec<Tracks> = (0..6)
            .map(|step| frame(1, 400.0 + 8.0 * f64::from(step)))
            .collect();
        assert_eq!(after(&moving).phase, "preparation");
        assert_eq!(after(&[frame(1, 310.0)]).phase, "idle");
    }

    #[test]
    fn a_new_run_knows_nothing_of_the_last() {
        let mut frames: Vec<Tracks> = (0..6).map(|_| frame(1, 400.0)).collect();
        frames.push(frame(2, 400.0));
        assert_eq!(after(&frames).phase, "preparation");
    }
}
