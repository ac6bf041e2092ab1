//! How restless a sequence of pictures is: what flickers changes to and fro.

/// Pictures so far. Only two of them are kept.
#[derive(Debug, Default)]
pub struct Sequence {
    /// The last two, the older one first.
    kept: Vec<Frame>,
    second_sum: f64,
    seconds: usize,
    rms: Vec<f64>,
}

#[derive(Debug)]
struct Frame {
    rgb: Vec<[f32; 3]>,
    on: Vec<bool>,
}

/// Figures of a sequence, in the unit of the pictures; `None` where there are too few of them, or nothing is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Restlessness {
    /// Mean magnitude of a channel's second difference over three consecutive pictures, over the pixels that count in
    /// the middle one. Uniform motion of a smooth picture has hardly any.
    pub second_difference: Option<f64>,
    /// Median over consecutive pictures of the root of the mean squared difference of channels, over the pixels that
    /// count in either.
    pub rms_median: Option<f64>,
    /// The largest of these.
    pub rms_max: Option<f64>,
}

impl Sequence {
    /// Adds a picture; `on` says which pixels count.
    ///
    /// # Panics
    /// If pictures differ in size.
    pub fn add(&mut self, rgb: &[[f32; 3]], on: Vec<bool>) {
        assert_eq!(rgb.len(), on.len(), "a truth value a pixel");
        let new = Frame { rgb: rgb.to_vec(), on };
        if let Some(last) = self.kept.last() {
            assert_eq!(last.rgb.len(), rgb.len(), "pictures of one size");
            let (mut sum, mut count) = (0.0, 0usize);
            for (i, (a, b)) in last.rgb.iter().zip(rgb).enumerate() {
                if last.on[i] || new.on[i] {
                    sum += (0..3).map(|k| f64::from(b[k] - a[k]).powi(2)).sum::<f64>();
                    count += 3;
                }
            }
            if count > 0 {
                self.rms.push((sum / count as f64).sqrt());
            }
        }
        if let [first, second] = &self.kept[..] {
            for (i, c) in rgb.iter().enumerate().filter(|(i, _)| second.on[*i]) {
                let (a, b) = (first.rgb[i], second.rgb[i]);
                self.second_sum +=
                    (0..3).map(|k| f64::from(a[k] - 2.0 * b[k] + c[k]).abs()).sum::<f64>();
                self.seconds += 3;
            }
            self.kept.remove(0);
        }
        self.kept.push(new);
    }

    /// The figures so far.
    pub fn figures(&self) -> Restlessness {
        let mut rms = self.rms.clone();
        rms.sort_by(f64::total_cmp);
        let n = rms.len();
        Restlessness {
            second_difference: (self.seconds > 0).then(|| self.second_sum / self.seconds as f64),
            rms_median: (n > 0).then(|| 0.5 * (rms[(n - 1) / 2] + rms[n / 2])),
            rms_max: rms.last().copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(pictures: &[[f32; 2]]) -> Restlessness {
        let mut sequence = Sequence::default();
        for &[a, b] in pictures {
            sequence.add(&[[a; 3], [b; 3]], vec![true, false]);
        }
        sequence.figures()
    }

    #[test]
    fn flicker_counts_and_steady_change_does_not() {
        assert_eq!(figures(&[[1.0, 5.0]]), Restlessness::default());
        // The second pixel does not count.
        let steady = figures(&[[0.0, 1.0], [0.25, 9.0], [0.5, 0.0], [0.75, 7.0]]);
        assert_eq!(steady.second_difference, Some(0.0));
        assert_eq!((steady.rms_median, steady.rms_max), (Some(0.25), Some(0.25)));
        let flicker = figures(&[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.5, 0.0]]);
        assert_eq!(flicker.second_difference, Some((2.0 + 1.5) / 2.0));
        assert_eq!((flicker.rms_median, flicker.rms_max), (Some(1.0), Some(1.0)));
    }
}
