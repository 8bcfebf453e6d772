//! What a host writes between two frames.

/// Writes since the last frame, merged so that those to one target do not overlap and the last one wins.
pub struct Writes<T> {
    writes: Vec<Write<T>>,
    /// Bytes of all writes.
    bytes: Vec<u8>,
}

/// Bytes on their way to one buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Write<T> {
    /// The buffer.
    pub target: T,
    /// Where in the buffer.
    pub offset: u64,
    /// Where in [`Writes::bytes`].
    pub start: usize,
    /// How many.
    pub len: usize,
}

impl<T: PartialEq> Write<T> {
    const fn end(&self) -> u64 {
        self.offset + self.len as u64
    }

    fn overlaps(&self, target: &T, offset: u64, len: usize) -> bool {
        self.target == *target && self.offset < offset + len as u64 && offset < self.end()
    }
}

impl<T: PartialEq> Writes<T> {
    /// None, with room for so many bytes.
    #[must_use]
    pub fn with_capacity(bytes: usize) -> Self {
        Self { writes: Vec::new(), bytes: Vec::with_capacity(bytes) }
    }

    /// Whether there is nothing to bring over.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.writes.is_empty()
    }

    /// The writes, in the order in which their targets were first written to.
    #[must_use]
    pub fn all(&self) -> &[Write<T>] {
        &self.writes
    }

    /// The bytes of all writes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Bring bytes over with the next frame, over what earlier calls brought there.
    pub fn push(&mut self, target: T, offset: u64, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let overlapping = |w: &Write<T>| w.overlaps(&target, offset, bytes.len());
        let inside = self
            .writes
            .iter()
            .find(|w| overlapping(w) && w.offset <= offset && offset + bytes.len() as u64 <= w.end());
        if let Some(write) = inside {
            let at = write.start + (offset - write.offset) as usize;
            self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
            return;
        }
        // One write over everything that the new one touches: together they have no gaps.
        let touched = self.writes.iter().filter(|w| overlapping(w));
        let begin = touched.clone().map(|w| w.offset).min().unwrap_or(offset).min(offset);
        let end = touched.map(Write::end).max().unwrap_or(0).max(offset + bytes.len() as u64);
        let start = self.bytes.len();
        let len = (end - begin) as usize;
        self.bytes.resize(start + len, 0);
        for write in self.writes.extract_if(.., |w| overlapping(w)) {
            let at = start + (write.offset - begin) as usize;
            self.bytes.copy_within(write.start..write.start + write.len, at);
        }
        let at = start + (offset - begin) as usize;
        self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
        self.writes.push(Write { target, offset: begin, start, len });
    }

    /// Forget the writes to targets that are no longer there.
    pub fn forget(&mut self, gone: impl Fn(&T) -> bool) {
        self.writes.retain(|w| !gone(&w.target));
    }

    /// Forget all, and keep the memory.
    pub fn clear(&mut self) {
        self.writes.clear();
        self.bytes.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a target of 16 bytes holds after the writes, and how many there are.
    fn written(pushes: &[(u64, &[u8])]) -> (Vec<u8>, usize) {
        let mut writes = Writes::with_capacity(0);
        for (offset, bytes) in pushes {
            writes.push('a', *offset, bytes);
        }
        let mut contents = vec![0; 16];
        for (i, write) in writes.all().iter().enumerate() {
            let others = &writes.all()[..i];
            assert!(others.iter().all(|w| !w.overlaps(&'a', write.offset, write.len)), "no overlap");
            contents[write.offset as usize..write.end() as usize]
                .copy_from_slice(&writes.bytes()[write.start..write.start + write.len]);
        }
        (contents, writes.all().len())
    }

    #[test]
    fn later_writes_win() {
        let (a, b, c) = (&[1; 4][..], &[2; 4][..], &[3; 12][..]);
        assert_eq!(written(&[(0, a), (8, b)]), (vec![1, 1, 1, 1, 0, 0, 0, 0, 2, 2, 2, 2, 0, 0, 0, 0], 2));
        assert_eq!(written(&[(0, a), (0, b)]), (vec![2, 2, 2, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], 1));
        assert_eq!(written(&[(0, a), (2, b)]), (vec![1, 1, 2, 2, 2, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], 1));
        let three = [(0, a), (8, b), (2, c)];
        assert_eq!(written(&three), (vec![1, 1, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 0, 0], 1));
        assert_eq!(
            written(&[(2, c), (0, a), (6, b)]).0,
            vec![1, 1, 1, 1, 3, 3, 2, 2, 2, 2, 3, 3, 3, 3, 0, 0]
        );
        assert_eq!(written(&[(0, a), (4, b)]).1, 2, "neighbours do not overlap");
        assert_eq!(written(&[(0, &[])]).1, 0);
    }

    #[test]
    fn other_buffers_are_left_alone() {
        let mut writes = Writes::with_capacity(0);
        writes.push('a', 0, &[1; 4]);
        writes.push('b', 0, &[2; 4]);
        assert_eq!(writes.all().len(), 2);
        writes.forget(|target| *target == 'b');
        assert_eq!(writes.all().iter().map(|w| w.target).collect::<Vec<_>>(), ['a']);
        writes.clear();
        assert!(writes.is_empty() && writes.bytes().is_empty());
    }
}
