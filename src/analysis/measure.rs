//! Times that can be trusted: frames that alternate with those of a reference, medians with quartiles, ratios turn by turn.

use crate::backend::Backend;
use crate::camera::Eye;
use crate::context::Context;
use crate::error::Result;
use crate::frame::{FrameReport, Renderer};
use crate::methods::{Made, Method, Params};
use crate::scene::PreparedScene;

/// A quantity that was measured several times. Quartiles are by nearest rank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Half of the values are not above it.
    pub median: f64,
    /// A quarter of the values are not above it.
    pub q1: f64,
    /// A quarter of the values are not below it.
    pub q3: f64,
    /// Number of values.
    pub n: usize,
}

impl Quantity {
    /// `None` if there are no values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        Some(Self {
            median: values[last / 2],
            q1: values[last / 4],
            q3: values[last - last / 4],
            n: values.len(),
        })
    }

    /// How far the quartiles are apart, as a share of the median.
    pub fn spread(&self) -> f64 {
        (self.q3 - self.q1) / self.median.abs()
    }
}

/// A ratio whose quartiles are farther apart than this share of its median is noisy.
pub const NOISY_SPREAD: f64 = 0.1;

/// How many times as long one side takes as another, over pairs that were measured one right after the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// Over the pairs.
    pub of: Quantity,
    /// The pairs disagree by more than [`NOISY_SPREAD`]: the machine was busy, or there were too few.
    pub noisy: bool,
}

impl Ratio {
    /// Of `a` to `b`, as many pairs as the shorter has; `None` if that is none.
    pub fn of(a: &[f64], b: &[f64]) -> Option<Self> {
        let of = Quantity::of(a.iter().zip(b).map(|(a, b)| a / b))?;
        // Not a number is noisy, too.
        Some(Self { of, noisy: !matches!(of.spread(), s if s <= NOISY_SPREAD) })
    }
}

/// Where sides are run: a scene, an eye that looks at it, and a backend with its memory.
pub struct Stage<'a> {
    scene: &'a PreparedScene,
    eye: Eye,
    renderer: Renderer,
}

impl<'a> Stage<'a> {
    /// What the eye sees directly is found out here, once: it is not measured.
    pub fn new(scene: &'a PreparedScene, eye: &Eye, backend: Box<dyn Backend>) -> Self {
        let mut renderer = Renderer::on(backend);
        renderer.see(scene, eye);
        Self { scene, eye: *eye, renderer }
    }

    /// The renderer, which has seen the scene.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// The backend, for another stage.
    pub fn into_backend(self) -> Box<dyn Backend> {
        self.renderer.into_backend()
    }

    fn run(&mut self, side: &Side) -> Result<FrameReport> {
        let Side { method, params, made, .. } = side;
        let reflected = self.renderer.reflect(
            self.scene,
            &self.eye,
            *method,
            made,
            params,
            false,
            &Context::default(),
        )?;
        Ok(reflected.0)
    }
}

/// A method with its parameters on one of the stages.
pub struct Side {
    stage: usize,
    method: &'static dyn Method,
    params: Params,
    made: Made,
}

impl Side {
    /// `stage`: index into the stages that it will be run with.
    ///
    /// # Errors
    /// The method refuses the scene, or cancelled.
    ///
    /// # Panics
    /// If there is no such stage.
    pub fn new(
        stages: &[Stage<'_>],
        stage: usize,
        method: &'static dyn Method,
        params: Params,
        cx: &Context,
    ) -> Result<Self> {
        let scene = stages[stage].scene;
        method.qualify(scene, &params)?;
        let made = method.prepare(scene, &params, cx)?;
        Ok(Self { stage, method, params, made })
    }
}

/// How often sides take their turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounds {
    /// Rounds that count.
    pub repeat: u32,
    /// Rounds before that: they fill caches and memory.
    pub warm_up: u32,
    /// A turn has as many frames of each of its two as fit into so many milliseconds, of which the fastest counts: a single
    /// frame is at the mercy of whatever else the machine does, and that only ever makes it slower.
    pub least_ms: f64,
    /// A turn has no fewer frames, unless they take more than [`LONG`] times `least_ms`.
    pub least_frames: u32,
    /// A side that has taken so many milliseconds and [`LEAST_TURNS`] turns is left out from then on.
    pub most_ms: f64,
}

/// No side has fewer turns that count, if there are so many rounds.
pub const LEAST_TURNS: usize = 3;
/// Turns longer than so many times what they should be have fewer frames.
pub const LONG: f64 = 4.0;
/// A turn has no more frames.
const MOST_FRAMES: f64 = 32.0;
/// No fewer of the reference: one before and one after a side's only frame.
const LEAST_BESIDE: u32 = 2;

/// What one side took, by turn.
#[derive(Clone, Debug, Default)]
pub struct Timed {
    /// Each of a turn's fastest frame.
    pub reports: Vec<FrameReport>,
    /// Milliseconds of the reference's fastest frame of the same turn.
    pub beside_ms: Vec<f64>,
}

impl Timed {
    /// Reflections of a frame, milliseconds, by turn.
    pub fn reflection_ms(&self) -> Vec<f64> {
        self.reports.iter().map(FrameReport::reflection_ms).collect()
    }

    /// Quartiles of that; `None` if nothing was measured.
    pub fn total(&self) -> Option<Quantity> {
        Quantity::of(self.reflection_ms())
    }

    /// To the reference, turn by turn; `None` for the reference itself.
    pub fn ratio(&self) -> Option<Ratio> {
        Ratio::of(&self.reflection_ms(), &self.beside_ms)
    }

    /// Quartiles of a stage's time by the reference's whole time, turn by turn: what the machine does slowly cancels out.
    /// `None` if it was not timed apart, or there is no reference.
    pub fn relative(&self, pick: fn(&FrameReport) -> Option<f64>) -> Option<Quantity> {
        let pairs = self.reports.iter().zip(&self.beside_ms);
        Quantity::of(pairs.filter_map(|(report, beside)| Some(pick(report)? / beside)))
    }

    /// Quartiles of a stage's time; `None` if it was not timed apart.
    pub fn quantity(&self, pick: fn(&FrameReport) -> Option<f64>) -> Option<Quantity> {
        Quantity::of(self.reports.iter().filter_map(pick))
    }

    /// Counts, and all times as medians.
    ///
    /// # Panics
    /// If nothing was measured.
    pub fn report(&self) -> FrameReport {
        FrameReport::median(&self.reports)
    }
}

/// Measures sides against a reference. In a side's turn its frames alternate with those of the reference, A B A B, and the
/// fastest of each count: so both had the same machine, whatever else ran on it. The sides take their turns one after the
/// other, in rounds. Returns the reference's times, a turn of each side each, and the sides'. `step` is told how much is done,
/// 0 to 1, before each turn.
///
/// # Errors
/// A backend failed, or `step` did.
pub fn against(
    stages: &mut [Stage<'_>],
    reference: &Side,
    sides: &[Side],
    rounds: Rounds,
    mut step: impl FnMut(f64) -> Result<()>,
) -> Result<(Timed, Vec<Timed>)> {
    let mut timed = vec![Timed::default(); sides.len()];
    let mut own = Timed::default();
    let mut frames = vec![[1, LEAST_BESIDE]; sides.len()];
    let mut spent = vec![0.0; sides.len()];
    let total = rounds.warm_up + rounds.repeat;
    for round in 0..total {
        for (i, side) in sides.iter().enumerate() {
            let done = f64::from(round) + i as f64 / sides.len() as f64;
            step(done / f64::from(total))?;
            if spent[i] > rounds.most_ms && timed[i].reports.len() >= LEAST_TURNS {
                continue;
            }
            let [report, beside] = turn(stages, [side, reference], frames[i])?;
            let [ms, beside_ms] = [&report, &beside].map(FrameReport::reflection_ms);
            if round < rounds.warm_up {
                frames[i] = [frames_of(rounds, ms), frames_of(rounds, beside_ms).max(LEAST_BESIDE)];
                continue;
            }
            spent[i] += ms * f64::from(frames[i][0]);
            timed[i].beside_ms.push(beside_ms);
            timed[i].reports.push(report);
            own.reports.push(beside);
        }
    }
    Ok((own, timed))
}

/// The fastest of so many frames of two sides, which are spread evenly over the turn.
fn turn(stages: &mut [Stage<'_>], sides: [&Side; 2], frames: [u32; 2]) -> Result<[FrameReport; 2]> {
    let mut reports = [Vec::new(), Vec::new()];
    for k in alternating(frames) {
        reports[k].push(stages[sides[k].stage].run(sides[k])?);
    }
    Ok(reports.map(FrameReport::fastest))
}

/// 0 and 1 as often as said, each evenly spread.
fn alternating(frames: [u32; 2]) -> Vec<usize> {
    let place =
        |k: usize| (0..frames[k]).map(move |i| ((f64::from(i) + 0.5) / f64::from(frames[k]), k));
    let mut order: Vec<(f64, usize)> = place(0).chain(place(1)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.into_iter().map(|(_, k)| k).collect()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to MOST_FRAMES")]
fn frames_of(rounds: Rounds, ms: f64) -> u32 {
    let fit = rounds.least_ms / ms.max(1e-3);
    fit.max(f64::from(rounds.least_frames).min(LONG * fit)).clamp(1.0, MOST_FRAMES) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_values_by_rank() {
        assert_eq!(Quantity::of([]), None);
        let of = |values: &[f64]| {
            let q = Quantity::of(values.iter().copied()).unwrap();
            ([q.q1, q.median, q.q3], q.n)
        };
        assert_eq!(of(&[7.0]), ([7.0; 3], 1));
        assert_eq!(of(&[5.0, 1.0, 4.0, 2.0, 3.0]), ([2.0, 3.0, 4.0], 5));
        // One interruption moves none of them.
        assert_eq!(of(&[5.0, 1.0, 4.0, 2.0, 900.0]), ([2.0, 4.0, 5.0], 5));
    }

    #[test]
    fn ratios_are_of_pairs_and_say_if_these_disagree() {
        // The machine became three times as slow in the middle: each pair tells the same.
        let (a, b) = ([2.0, 2.0, 6.0, 6.0], [1.0, 1.0, 3.0, 3.0]);
        let ratio = Ratio::of(&a, &b).unwrap();
        assert_eq!((ratio.of.median, ratio.of.spread(), ratio.noisy), (2.0, 0.0, false));
        let noisy = |spread: f64| {
            let a: Vec<f64> = (0..9).map(|i| 1.0 + spread * (f64::from(i) - 4.0) / 4.0).collect();
            Ratio::of(&a, &[1.0; 9]).unwrap().noisy
        };
        // Quartiles at half of the way from the middle.
        assert!(!noisy(0.09) && noisy(0.11), "{NOISY_SPREAD}");
        assert_eq!(Ratio::of(&[1.0, 2.0], &[1.0]).unwrap().of.n, 1);
        assert!(Ratio::of(&[0.0], &[0.0]).unwrap().noisy, "not a number");
        assert_eq!(Ratio::of(&[1.0], &[]), None);
    }

    #[test]
    fn frames_of_a_turn_alternate() {
        assert_eq!(alternating([1, 2]), [1, 0, 1]);
        assert_eq!(alternating([2, 2]), [0, 1, 0, 1]);
        assert_eq!(alternating([2, 6]), [1, 0, 1, 1, 1, 0, 1, 1]);
    }

    #[test]
    fn short_frames_are_drawn_several_times_a_turn() {
        let rounds =
            Rounds { repeat: 1, warm_up: 1, least_ms: 30.0, least_frames: 3, most_ms: 1e3 };
        for (ms, frames) in [(7.0, 4), (31.0, 3), (50.0, 2), (200.0, 1), (0.0, 32)] {
            assert_eq!(frames_of(rounds, ms), frames, "{ms} ms");
        }
    }
}
