//! Numbers in bytes, never read beyond the end.

use std::sync::Arc;

use crate::column::Flaw;

/// Which byte comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

/// A kind of number that files hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl Number {
    /// Bytes of one.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number that begins at a byte; none if the bytes end before it does.
    pub(super) fn get(self, bytes: &[u8], at: usize, order: Order) -> Option<f64> {
        macro_rules! read {
            ($kind:ty) => {{
                let raw = *bytes.get(at..)?.first_chunk()?;
                match order {
                    Order::Little => <$kind>::from_le_bytes(raw),
                    Order::Big => <$kind>::from_be_bytes(raw),
                }
            }};
        }
        Some(match self {
            Self::I8 => f64::from(read!(i8)),
            Self::U8 => f64::from(read!(u8)),
            Self::I16 => f64::from(read!(i16)),
            Self::U16 => f64::from(read!(u16)),
            Self::I32 => f64::from(read!(i32)),
            Self::U32 => f64::from(read!(u32)),
            Self::I64 => read!(i64) as f64,
            Self::U64 => read!(u64) as f64,
            Self::F16 => half(read!(u16)),
            Self::F32 => f64::from(read!(f32)),
            Self::F64 => read!(f64),
        })
    }
}

/// A number of half precision.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    sign * match exponent {
        0 => fraction * 2f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2f64.powi(exponent - 15),
    }
}

/// Numbers that stand at even distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strided {
    pub(super) start: usize,
    /// Bytes from one to the next.
    pub(super) stride: usize,
    pub(super) count: usize,
    pub(super) number: Number,
    pub(super) order: Order,
}

impl Strided {
    /// True if all of them stand within the first `len` bytes.
    pub(super) fn fits(&self, len: usize) -> bool {
        let last =
            self.count.checked_sub(1).map(|n| n.checked_mul(self.stride).and_then(|o| o.checked_add(self.start)));
        match last {
            None => true,
            Some(last) => last.and_then(|l| l.checked_add(self.number.size())).is_some_and(|end| end <= len),
        }
    }

    /// Appends them to a list.
    pub(super) fn append(&self, bytes: &[u8], values: &mut Vec<f64>) -> Result<(), Flaw> {
        if !self.fits(bytes.len()) {
            let Self { count, start, .. } = self;
            let what = format!("{count} numbers are said to begin here, more than the {} bytes hold", bytes.len());
            return Err(Flaw::at(what, *start));
        }
        values.reserve_exact(self.count);
        let numbers = (0..self.count).map_while(|k| self.number.get(bytes, self.start + k * self.stride, self.order));
        values.extend(numbers);
        Ok(())
    }

    /// All of them.
    pub(super) fn read(&self, bytes: &[u8]) -> Result<Vec<f64>, Flaw> {
        let mut values = Vec::new();
        self.append(bytes, &mut values)?;
        Ok(values)
    }
}

/// A place in bytes that moves on as it is read.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    pub(super) order: Order,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize, order: Order) -> Self {
        Self { bytes, at, order }
    }

    /// The byte that is read next.
    pub(super) fn position(&self) -> usize {
        self.at
    }

    pub(super) fn move_to(&mut self, at: usize) {
        self.at = at;
    }

    /// Bytes left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], Flaw> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        let taken = taken.ok_or_else(|| self.short(count))?;
        self.at += count;
        Ok(taken)
    }

    fn short(&self, count: usize) -> Flaw {
        Flaw::at(format!("it ends where {count} more bytes should be: it is cut short or damaged"), self.at)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Flaw> {
        let taken = self.take(N)?;
        taken.first_chunk().copied().ok_or_else(|| self.short(N))
    }

    pub(super) fn u8(&mut self) -> Result<u8, Flaw> {
        self.array().map(|[byte]| byte)
    }

    pub(super) fn u16(&mut self) -> Result<u16, Flaw> {
        let raw = self.array()?;
        Ok(if self.order == Order::Little { u16::from_le_bytes(raw) } else { u16::from_be_bytes(raw) })
    }

    pub(super) fn u32(&mut self) -> Result<u32, Flaw> {
        let raw = self.array()?;
        Ok(if self.order == Order::Little { u32::from_le_bytes(raw) } else { u32::from_be_bytes(raw) })
    }

    pub(super) fn u64(&mut self) -> Result<u64, Flaw> {
        let raw = self.array()?;
        Ok(if self.order == Order::Little { u64::from_le_bytes(raw) } else { u64::from_be_bytes(raw) })
    }

    pub(super) fn f64(&mut self) -> Result<f64, Flaw> {
        self.u64().map(f64::from_bits)
    }

    /// A count or an offset; beyond what a machine can address it is damage.
    pub(super) fn size(&mut self) -> Result<usize, Flaw> {
        let at = self.at;
        let value = self.u64()?;
        usize::try_from(value).map_err(|_| Flaw::at(format!("{value} is no size"), at))
    }
}

/// Bytes that values are decoded from: the file's own, or those that were inflated.
#[derive(Clone)]
pub(super) enum DataBytes<'a> {
    File(&'a [u8]),
    Inflated(Arc<[u8]>),
}

impl DataBytes<'_> {
    pub(super) fn bytes(&self) -> &[u8] {
        match self {
            Self::File(bytes) => bytes,
            Self::Inflated(bytes) => bytes,
        }
    }
}
