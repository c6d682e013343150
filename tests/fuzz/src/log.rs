//! Recorded logs: candump's two formats, Vector ASC and pcapng. The reader finds out which it is.

use protocol::wire::BitTiming;
use trace::convert::{Converter, Target};
use trace::decode::{Decoder, Format};
use trace::stats::Gatherer;
use trace::{Entry, ReadError, Reader, Record};

/// The records of a log; lines that are none are left out.
pub(crate) fn records(bytes: &[u8]) -> Vec<Record> {
    let mut records = Vec::new();
    for read in Reader::new(bytes) {
        match read {
            Ok(record) => records.push(record),
            Err(ReadError::Line { problem, .. }) => assert!(!problem.to_string().is_empty()),
            Err(ReadError::Io { .. }) => break,
        }
    }
    records
}

fn convert(records: &[Record], target: Target) -> Vec<Record> {
    let mut converter = Converter::new(Vec::new(), target).unwrap();
    for record in records {
        converter.record(record).unwrap();
    }
    let bytes = converter.finish().unwrap();
    Reader::new(&bytes[..])
        .map(|read| read.unwrap_or_else(|error| panic!("{target:?}: {error}")))
        .collect()
}

/// What is read can be decoded, counted and converted; what is written is read as the same.
pub(crate) fn log(bytes: &[u8]) {
    let records = records(bytes);
    for format in [Format::Text, Format::Csv, Format::JsonLines] {
        let mut decoder = Decoder::new(Vec::new(), format).unwrap();
        for record in &records {
            decoder.record(record).unwrap();
        }
        let text = String::from_utf8(decoder.finish().unwrap()).unwrap();
        if format == Format::JsonLines {
            assert_eq!(text.lines().count(), records.len());
            for line in text.lines() {
                serde_json::from_str::<serde_json::Value>(line).unwrap();
            }
        }
    }
    let mut gatherer = Gatherer::new(BitTiming::default());
    for record in &records {
        gatherer.record(record);
    }
    let statistics = gatherer.statistics();
    let frames = |records: &[Record]| -> Vec<Entry> {
        let entries = records.iter().map(|record| record.entry);
        entries
            .filter(|entry| matches!(entry, Entry::Frame(_)))
            .collect()
    };
    assert_eq!(statistics.frames, frames(&records).len() as u64);
    let ids = statistics.interfaces.iter().flat_map(|bus| &bus.ids);
    for id in ids {
        assert!(id.rate_hz.is_finite() && id.load.is_finite(), "{id:?}");
        if let Some(period) = &id.period {
            assert!(period.mean_ms.is_finite() && period.jitter_ms.is_finite());
            assert!(period.min_ms <= period.mean_ms && period.mean_ms <= period.max_ms);
            let [low, high] = period.range_90_ms;
            assert!(period.min_ms <= low && low <= high && high <= period.max_ms);
        }
    }
    assert!(!(statistics.to_string() + &statistics.histograms()).is_empty());
    serde_json::to_string(&statistics).unwrap();
    for target in [Target::Candump, Target::Pcapng] {
        assert_eq!(convert(&records, target), records, "{target:?}");
    }
    // ASC numbers its channels and has error frames without their data.
    assert_eq!(frames(&convert(&records, Target::Asc)), frames(&records));
}
