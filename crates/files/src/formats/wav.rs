//! WAV: sound cards and some data loggers. Whole numbers are shares of full scale, from −1 to 1.

use std::io::Cursor;

use hound::{SampleFormat, WavReader};

use crate::column::{FileColumn, FileContents, Flaw};
use crate::format::FileFormat;

pub(crate) const FORMAT: FileFormat = FileFormat::of_columns(
    "WAV",
    &["wav", "wave"],
    |bytes| bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WAVE"),
    read,
);

fn flaw(error: &hound::Error) -> Flaw {
    match error {
        hound::Error::Unsupported => Flaw::new("its samples are compressed or of an unusual kind")
            .try_this("export it as PCM of 16, 24 or 32 bits, or as 32-bit float"),
        error => Flaw::new(format!("it is damaged or cut short ({error})")),
    }
}

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let reader = WavReader::new(Cursor::new(bytes)).map_err(|e| flaw(&e))?;
    let spec = reader.spec();
    let channels = usize::from(spec.channels);
    if channels == 0 || spec.sample_rate == 0 || spec.bits_per_sample == 0 {
        return Err(Flaw::new("its header gives no channels, no bits or no sampling rate"));
    }
    // The header's count may be more than the file holds.
    let said = reader.duration() as usize;
    let held = bytes.len() / channels / usize::from(spec.bits_per_sample).div_ceil(8);
    let len = said.min(held);
    let mut contents = FileContents::default();
    if len < said {
        contents
            .notices
            .push(format!("the header tells of {said} samples, the file ends before: those that it has were taken"));
    }
    let interval = f64::from(spec.sample_rate).recip();
    for channel in 0..channels {
        let name = if channels == 1 { "signal".to_owned() } else { format!("channel{}", channel + 1) };
        let decode = move || {
            let mut reader = WavReader::new(Cursor::new(bytes)).map_err(|e| flaw(&e))?;
            let mut values = Vec::new();
            let full = 2f64.powi(i32::from(spec.bits_per_sample) - 1);
            // A sample that the file is too short for ends the channel.
            match spec.sample_format {
                SampleFormat::Int => {
                    let samples = reader.samples::<i32>().skip(channel).step_by(channels);
                    values.extend(samples.map_while(Result::ok).map(|v| f64::from(v) / full));
                }
                SampleFormat::Float => {
                    let samples = reader.samples::<f32>().skip(channel).step_by(channels);
                    values.extend(samples.map_while(Result::ok).map(f64::from));
                }
            }
            values.resize(values.len().max(len), f64::NAN);
            Ok(values)
        };
        contents.columns.push(FileColumn::new(&name, "", len, decode).sampled_evenly(0.0, interval));
    }
    Ok(contents)
}
