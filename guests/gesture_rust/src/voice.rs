//! Questions about who is heard, and the tokens that say it: what `deixis swap` talks to.

use crate::contract::{self, decode, encode, Named, STAGE};
use crate::place::{From, Place};
use crate::{now_ns, Failure};
use std::time::{Duration, Instant};
use zenoh::handlers::{RingChannel, RingChannelHandler};
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable};
use zenoh::Wait;

/// What is answered later counts for nothing.
const TAKE_WITHIN: Duration = Duration::from_millis(1500);

pub struct Voice<'a> {
    session: &'a zenoh::Session,
    prefix: String,
    instance: String,
    asked: Queryable<RingChannelHandler<Query>>,
    token: Option<(bool, LivelinessToken)>,
    pub leaving: bool,
}

impl<'a> Voice<'a> {
    pub fn new(session: &'a zenoh::Session, robot: &str, instance: &str) -> Result<Self, Failure> {
        let prefix = format!("deixis/{robot}");
        let asked = session
            .declare_queryable(format!("{prefix}/{STAGE}/voice/{instance}"))
            .with(RingChannel::new(8))
            .wait()?;
        Ok(Self {
            session,
            prefix,
            instance: instance.to_string(),
            asked,
            token: None,
            leaving: false,
        })
    }

    /// Hold the token that says whether we are heard, in place of the one before.
    pub fn hold_token(&mut self, place: &Place) -> Result<(), Failure> {
        let heard = place.state() == "speaks";
        if self.token.as_ref().is_some_and(|(said, _)| *said == heard) {
            return Ok(());
        }
        let key = format!("{}/@alive/{STAGE}/{}", self.prefix, self.instance);
        let key = if heard { key } else { format!("{key}/standby") };
        self.token = Some((heard, self.session.liveliness().declare_token(key).wait()?));
        Ok(())
    }

    /// Do what is asked of us, and answer each question with how we stand then.
    pub fn answer(&mut self, place: &mut Place) -> Result<(), Failure> {
        while let Some(query) = self.asked.try_recv()? {
            let done = self.obey(&query, place);
            self.hold_token(place)?;
            match done {
                Ok(()) => query
                    .reply(query.key_expr(), self.said(place))
                    .encoding(contract::VOICE)
                    .wait()?,
                Err(why) => query.reply_err(why).wait()?,
            }
        }
        Ok(())
    }

    fn obey(&mut self, query: &Query, place: &mut Place) -> Result<(), String> {
        let told = |name: &str| {
            let value = query.parameters().get(name).unwrap_or_default();
            let plain = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
            match value.len() <= 64 && value.chars().all(plain) {
                true => Ok(value.to_string()),
                false => Err(format!("{name}: no name of a process")),
            }
        };
        match told("op")?.as_str() {
            "" => Ok(()),
            "take" => self.take(&told("from")?, place),
            "yield" => place.give(&told("to")?),
            "leave" if place.state() == "yields" => {
                self.leaving = true;
                Ok(())
            }
            "leave" => Err("it has not yielded to anybody".to_string()),
            op => Err(format!("op: '{op}' is none of yield, take, leave")),
        }
    }

    /// Ask the one that is heard for a frame.
    fn take(&self, old: &str, place: &mut Place) -> Result<(), String> {
        if place.state() != "stands_by" {
            return Err("it does not stand by".to_string());
        }
        let selector = format!(
            "{}/{STAGE}/voice/{old}?op=yield;to={}",
            self.prefix, self.instance
        );
        let asked = Instant::now();
        let get = self.session.get(selector).timeout(TAKE_WITHIN).wait();
        let replies = get.map_err(|error| error.to_string())?;
        let reply = replies
            .recv_timeout(TAKE_WITHIN)
            .ok()
            .flatten()
            .filter(|_| asked.elapsed() < TAKE_WITHIN);
        let Some(reply) = reply else {
            return Err(format!("{old} has not answered within 1.5 s"));
        };
        let sample = reply.result().map_err(|error| {
            let why = error.payload().to_bytes();
            format!("{old}: {}", String::from_utf8_lossy(&why))
        })?;
        let payload = sample.payload().to_bytes();
        let named: Named = decode(&sample.encoding().to_string(), contract::VOICE, &payload)?;
        let from = named.run.zip(named.seq).map_or(From::All, From::Frame);
        place.take(old, from);
        Ok(())
    }

    fn said(&self, place: &Place) -> Vec<u8> {
        let fence = place.fence();
        encode(&contract::Voice {
            stamp_ns: now_ns(),
            stage: STAGE,
            instance: &self.instance,
            state: place.state(),
            other: &place.other,
            run: fence.map(|(run, _)| run),
            seq: fence.map(|(_, seq)| seq),
        })
    }
}
