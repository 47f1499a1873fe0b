//! Which frames this process answers aloud: how `deixis swap` puts it in another's place, or another in its.
//!
//! The rules stand in docs/contract.md, "Changing places". Nothing here knows of Zenoh.

use std::collections::HashMap;

/// How far ahead the frame is that is named to a newcomer, so that it has heard of it before the frame comes.
const LEAD_FRAMES: u64 = 15;

pub type Frame = (u64, u64);

/// A frame and all behind it, or all that come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum From {
    All,
    Frame(Frame),
}

#[derive(Default)]
pub struct Place {
    first: Option<From>,
    end: Option<From>,
    pub other: String,
    newest: Option<Frame>,
    runs: HashMap<u64, usize>,
}

impl Place {
    pub fn new(stands_by: bool) -> Self {
        Self {
            first: (!stands_by).then_some(From::All),
            ..Self::default()
        }
    }

    /// As others are told it.
    pub fn state(&self) -> &'static str {
        match (self.first, self.end) {
            (None, _) => "stands_by",
            (_, None) => "speaks",
            _ => "yields",
        }
    }

    /// The first frame that is the newcomer's; none where all are, or nobody has changed places.
    pub fn fence(&self) -> Option<Frame> {
        match self.end.or(self.first) {
            Some(From::Frame(frame)) => Some(frame),
            _ => None,
        }
    }

    /// Whether the answer to this frame is to be heard. To be asked once for each, in the order of their coming.
    pub fn is_ours(&mut self, frame: Frame) -> bool {
        self.newest = Some(frame);
        self.order(frame); // also where nothing is compared yet: runs count in the order in which they were met
        self.is_from(self.first, frame) && !self.is_from(self.end, frame)
    }

    /// The one that is heard has named this frame.
    pub fn take(&mut self, other: &str, from: From) {
        self.other = other.to_string();
        self.first = Some(from);
    }

    /// Name a frame a little ahead; the same one when the same newcomer asks again.
    pub fn give(&mut self, other: &str) -> Result<(), String> {
        if self.first.is_none() {
            return Err("it is not heard itself".to_string());
        }
        if self.end.is_some() && self.other != other {
            return Err(format!("it yields to {} already", self.other));
        }
        if self.end.is_none() {
            self.other = other.to_string();
            self.end = Some(self.newest.map_or(From::All, |(run, seq)| {
                From::Frame((run, seq + 1 + LEAD_FRAMES))
            }));
        }
        Ok(())
    }

    fn is_from(&mut self, from: Option<From>, frame: Frame) -> bool {
        match from {
            None => false,
            Some(From::All) => true,
            Some(From::Frame(first)) => self.order(first) <= self.order(frame),
        }
    }

    /// Runs in the order of their coming, frames within a run by `seq`.
    fn order(&mut self, (run, seq): Frame) -> (usize, u64) {
        let next = self.runs.len();
        (*self.runs.entry(run).or_insert(next), seq)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(place: &mut Place, seqs: std::ops::Range<u64>) -> Vec<u64> {
        seqs.filter(|seq| place.is_ours((7, *seq))).collect()
    }

    #[test]
    fn two_change_places_and_each_frame_is_answered_by_one() {
        let (mut old, mut new) = (Place::new(false), Place::new(true));
        assert_eq!(heard(&mut old, 0..10).len(), 10);
        assert_eq!(heard(&mut new, 0..10).len(), 0);
        old.give("new").unwrap();
        assert!(old.give("third").is_err());
        let fence = old.fence().unwrap();
        assert_eq!(fence, (7, 10 + LEAD_FRAMES));
        new.take("old", From::Frame(fence));
        assert_eq!(heard(&mut old, 10..40), (10..fence.1).collect::<Vec<_>>());
        assert_eq!(heard(&mut new, 10..40), (fence.1..40).collect::<Vec<_>>());
        assert_eq!((old.state(), new.state()), ("yields", "speaks"));
        assert!(!old.is_ours((8, 0)) && new.is_ours((8, 0)));
    }

    #[test]
    fn without_frames_all_are_the_newcomers() {
        let mut old = Place::new(false);
        old.give("new").unwrap();
        assert_eq!(old.fence(), None);
        assert_eq!(heard(&mut old, 0..3).len(), 0);
    }
}
