//! How old a message is by clocks that are not ours: by how much longer it took than the quickest one of its run.

pub struct RelativeAge {
    run: Option<u64>,
    stamp_ns: i128,
    shortest_ns: i128,
}

impl RelativeAge {
    pub fn new() -> Self {
        Self {
            run: None,
            stamp_ns: 0,
            shortest_ns: 0,
        }
    }

    /// Seconds beyond the quickest, of a message with this stamp received at `received_ns` of our monotonic clock.
    pub fn age_s(&mut self, run: u64, stamp_ns: u64, received_ns: u128) -> f64 {
        let (stamp_ns, delay_ns) = (
            i128::from(stamp_ns),
            received_ns as i128 - i128::from(stamp_ns),
        );
        // Another run may be one of another clock, and a clock may be set back.
        if self.run != Some(run) || stamp_ns < self.stamp_ns || delay_ns < self.shortest_ns {
            self.shortest_ns = delay_ns;
        }
        self.run = Some(run);
        self.stamp_ns = stamp_ns;
        (delay_ns - self.shortest_ns) as f64 / 1e9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waited_is_old_and_a_clock_that_differs_or_is_set_back_makes_nothing_old() {
        let mut age = RelativeAge::new();
        let hour_ns = 3_600_000_000_000;
        assert_eq!(age.age_s(1, hour_ns, 0), 0.0);
        assert!((age.age_s(1, hour_ns + 33_000_000, 2_033_000_000) - 2.0).abs() < 1e-9);
        assert_eq!(age.age_s(1, hour_ns - 1, 2_100_000_000), 0.0);
        assert_eq!(age.age_s(2, 5, 9_000_000_000), 0.0);
    }
}
