//! Progress on a terminal; silence when piped or asked for.

use crate::relaxation::Event;
use crate::run::duration::rounded;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;

/// One bar, made when the first stage reports.
pub struct Progress {
    shown: bool,
    bar: Mutex<Option<ProgressBar>>,
}

impl Progress {
    pub fn new(quiet: bool) -> Self {
        Self { shown: !quiet && std::io::stderr().is_terminal(), bar: Mutex::new(None) }
    }

    pub fn update(&self, event: Event) {
        if let Event::Expect { step, seconds } = event {
            if self.shown {
                eprintln!("{step}: {} on this machine, as an estimate", rounded(seconds));
            }
            return;
        }
        let Event::Iteration { stage, iteration, last, epsilon } = event else { return };
        if !self.shown {
            return;
        }
        let Ok(mut bar) = self.bar.lock() else { return };
        let bar = bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("{prefix} {bar:40} {pos}/{len} {msg} {elapsed}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(last as u64).with_style(style)
        });
        bar.set_prefix(stage.title);
        bar.set_length(last as u64);
        bar.set_position(iteration as u64);
        bar.set_message(format!("epsilon {epsilon:.2e}"));
    }

    pub fn finish(&self) {
        if let Ok(Some(bar)) = self.bar.lock().map(|b| b.clone()) {
            bar.finish_and_clear();
        }
    }
}
