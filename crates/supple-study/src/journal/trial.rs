use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Error, Read, Seek, SeekFrom};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use redb::StorageBackend;

/// Bytes that are kept at once of what is written.
const BLOCK: u64 = 4096;

/// A file that is read and never written: what is written is kept in memory. Opening a database repairs it where a
/// program was killed; here, a damaged file can be tried without a byte of it changing.
#[derive(Debug)]
pub(super) struct Trial {
    state: Mutex<State>,
    ended: Ended,
}

/// Ends a trial: all that a database does on it fails from then on.
#[derive(Clone, Debug, Default)]
pub(super) struct Ended(Arc<AtomicBool>);

impl Ended {
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn check(&self) -> Result<(), Error> {
        if self.0.load(Ordering::Relaxed) { Err(Error::other("the trial has ended")) } else { Ok(()) }
    }
}

#[derive(Debug)]
struct State {
    file: File,
    /// Bytes of the file that are still visible; the rest was truncated.
    kept: u64,
    len: u64,
    /// Blocks that were written, by number.
    written: BTreeMap<u64, Vec<u8>>,
}

impl Trial {
    pub fn new(file: File) -> Result<Self, Error> {
        let len = file.metadata()?.len();
        let state = Mutex::new(State { file, kept: len, len, written: BTreeMap::new() });
        Ok(Self { state, ended: Ended::default() })
    }

    pub fn ended(&self) -> Ended {
        self.ended.clone()
    }

    fn with<T>(&self, work: impl FnOnce(&mut State) -> T) -> T {
        work(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl State {
    /// Bytes of a block as they would be now.
    fn block(&mut self, number: u64) -> Result<Vec<u8>, Error> {
        if let Some(block) = self.written.get(&number) {
            return Ok(block.clone());
        }
        let mut block = vec![0; BLOCK as usize];
        let start = number * BLOCK;
        let there = self.kept.saturating_sub(start).min(BLOCK) as usize;
        self.file.seek(SeekFrom::Start(start))?;
        self.file.read_exact(&mut block[..there])?;
        Ok(block)
    }

    /// Calls `each` with every block that a range touches, where in the block the range is, and where in the range.
    fn blocks(
        &mut self,
        offset: u64,
        len: usize,
        mut each: impl FnMut(&mut Self, u64, usize, std::ops::Range<usize>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut done = 0;
        while done < len {
            let at = offset + done as u64;
            let within = (at % BLOCK) as usize;
            let part = (len - done).min(BLOCK as usize - within);
            each(self, at / BLOCK, within, done..done + part)?;
            done += part;
        }
        Ok(())
    }
}

impl StorageBackend for Trial {
    fn len(&self) -> Result<u64, Error> {
        self.ended.check()?;
        Ok(self.with(|state| state.len))
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> Result<(), Error> {
        self.ended.check()?;
        self.with(|state| {
            if offset.checked_add(out.len() as u64).is_none_or(|end| end > state.len) {
                return Err(std::io::ErrorKind::UnexpectedEof.into());
            }
            state.blocks(offset, out.len(), |state, number, within, range| {
                let block = state.block(number)?;
                let len = range.len();
                out[range].copy_from_slice(&block[within..within + len]);
                Ok(())
            })
        })
    }

    fn set_len(&self, len: u64) -> Result<(), Error> {
        self.ended.check()?;
        self.with(|state| {
            state.kept = state.kept.min(len);
            state.len = len;
            // What is cut off is zero where the file grows again.
            state.written.split_off(&len.div_ceil(BLOCK));
            if let Some(block) = state.written.get_mut(&(len / BLOCK)) {
                block[(len % BLOCK) as usize..].fill(0);
            }
            Ok(())
        })
    }

    fn sync_data(&self) -> Result<(), Error> {
        self.ended.check()
    }

    fn write(&self, offset: u64, data: &[u8]) -> Result<(), Error> {
        self.ended.check()?;
        self.with(|state| {
            state.len = state.len.max(offset + data.len() as u64);
            state.blocks(offset, data.len(), |state, number, within, range| {
                let mut block = state.block(number)?;
                block[within..within + range.len()].copy_from_slice(&data[range]);
                state.written.insert(number, block);
                Ok(())
            })
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::io::Write;

    use super::*;

    #[test]
    fn what_is_written_is_read_and_the_file_stays_as_it_is() {
        let bytes: Vec<u8> = (0..10_000u32).map(|i| (i % 251) as u8).collect();
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(&bytes).unwrap();
        let trial = Trial::new(file.reopen().unwrap()).unwrap();
        let mut expected = bytes.clone();
        let read = |trial: &Trial, len| {
            let mut out = vec![0; len];
            trial.read(0, &mut out).map(|()| out)
        };
        assert_eq!(read(&trial, 10_000).unwrap(), expected);
        trial.write(4000, &[9; 5000]).unwrap();
        expected[4000..9000].fill(9);
        assert_eq!(read(&trial, 10_000).unwrap(), expected);
        trial.set_len(5000).unwrap();
        assert!(read(&trial, 5001).is_err());
        trial.set_len(20_000).unwrap();
        expected.truncate(5000);
        expected.resize(20_000, 0);
        assert_eq!(read(&trial, 20_000).unwrap(), expected);
        assert_eq!(trial.len().unwrap(), 20_000);
        assert_eq!(std::fs::read(file.path()).unwrap(), bytes);
    }
}
