//! The tables as JSON, and as Markdown for the book.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use frame_plan::DeviceInfo;
use serde::Serialize;
use spectral_cli::values::Size;
use xtask::whole_file;

use super::COLUMNS;
use super::coverage::CoverageRow;
use super::frames::Frames;
use super::moving::{self, MovingRow};
use super::objects::ObjectRow;

/// Everything that one run measured.
#[derive(Serialize)]
pub(super) struct Report {
    /// Pixels of a frame.
    #[serde(serialize_with = "as_pair")]
    pub(super) size: Size,
    /// Rounds of which the median counts.
    pub(super) rounds: u32,
    /// What ran.
    pub(super) executors: Vec<ExecutorTables>,
    /// What did not, and why.
    pub(super) skipped: Vec<(String, String)>,
}

/// One executor's tables.
#[derive(Serialize)]
pub(super) struct ExecutorTables {
    pub(super) device: DeviceInfo,
    /// Table 2.
    pub(super) objects: Vec<ObjectRow>,
    /// Table 3.
    pub(super) coverage: Vec<CoverageRow>,
    /// Real time.
    pub(super) moving: Vec<MovingRow>,
}

fn as_pair<S: serde::Serializer>(size: &Size, serializer: S) -> Result<S::Ok, S::Error> {
    [size.width, size.height].serialize(serializer)
}

impl Report {
    /// Writes both files into `folder`; the Markdown is returned.
    pub(super) fn write(&self, folder: &Path) -> Result<String> {
        let json = serde_json::to_string_pretty(self)?;
        let markdown = self.markdown();
        for (name, text) in [("bench.json", &json), ("bench.md", &markdown)] {
            whole_file::write(&folder.join(name), text.as_bytes())?;
        }
        Ok(markdown)
    }

    fn markdown(&self) -> String {
        let mut text = format!(
            "Pictures of {} x {} pixels, 512 x 512 texels of the light's view; medians of {} rounds.\n",
            self.size.width, self.size.height, self.rounds
        );
        for tables in &self.executors {
            let device = &tables.device;
            let sections = [
                format!("\n### {}: {} ({})\n", device.executor, device.device, device.driver),
                objects(&tables.objects),
                passes(&tables.objects),
                coverage(&tables.coverage),
                moving_frames(&tables.moving),
            ];
            text += &sections.join("\n");
        }
        for (id, reason) in &self.skipped {
            text += &format!("\n{id}: skipped, {reason}\n");
        }
        text
    }
}

fn objects(rows: &[ObjectRow]) -> String {
    let header = COLUMNS.map(|c| format!("{}, ms", c.name)).join(" | ");
    let ratios = COLUMNS[1..]
        .iter()
        .map(|c| format!("{} / {}", c.name, COLUMNS[0].name))
        .collect::<Vec<_>>()
        .join(" | ");
    let mut text = format!(
        "| object | faces | {header} | {ratios} | M photons |\n|---|{}\n",
        "---|".repeat(2 * COLUMNS.len() + 1)
    );
    for row in rows {
        let times = row.frames.iter().map(time).collect::<Vec<_>>().join(" | ");
        let ratios =
            row.frames[1..].iter().map(|f| format!("{:.2}", f.ratio)).collect::<Vec<_>>().join(" | ");
        let photons = row
            .frames
            .iter()
            .map(|f| format!("{:.2}", 1e-6 * f.photons as f64))
            .collect::<Vec<_>>()
            .join(" / ");
        let name = if row.object == row.scene {
            row.scene.clone()
        } else {
            format!("{} (`{}`)", row.object, row.scene)
        };
        line(&mut text, format_args!("| {name} | {} | {times} | {ratios} | {photons} |", row.faces));
    }
    text
}

/// Flicker is of second differences from frame to frame, mean and largest, see `asm_core::Flicker`.
fn moving_frames(rows: &[MovingRow]) -> String {
    let mut text = format!(
        "| {} moving frames of `{}`, {} x {} pixels, {} x {} texels of the light's view | ms | of these the plan, ms | made in \
         frames 3 to {} | flicker of total Y | flicker of texel Y |\n|---|---|---|---|---|---|\n",
        moving::FRAMES,
        moving::SCENE,
        moving::PICTURE[0],
        moving::PICTURE[1],
        moving::EMISSION_SIZE,
        moving::EMISSION_SIZE,
        moving::FRAMES
    );
    for MovingRow { method, run } in rows {
        let (made, before) = (run.made, run.made_by_second);
        let anew = [
            (made.pipelines - before.pipelines, "pipelines"),
            (made.buffers - before.buffers, "buffers"),
            (made.textures - before.textures, "textures"),
            (made.bindings - before.bindings, "bindings"),
        ];
        let anew = anew.map(|(count, what)| format!("{count} {what}")).join(", ");
        let flicker = |f: asm_core::Flicker| format!("{:.1e}, {:.1e}", f.mean, f.max);
        line(
            &mut text,
            format_args!(
                "| {method} | {} | {} | {anew} | {} | {} |",
                digits(run.milliseconds),
                digits(run.plan_milliseconds),
                flicker(run.total_y),
                flicker(run.texel_y)
            ),
        );
    }
    text
}

/// Median with the fastest and the slowest round.
fn time(frames: &Frames) -> String {
    let [fastest, slowest] = frames.range_ms;
    format!("{} ({} to {})", digits(frames.ms), digits(fastest), digits(slowest))
}

/// Three digits that count.
pub(super) fn digits(ms: f64) -> String {
    let decimals = (2 - ms.max(1e-3).log10().floor() as i32).clamp(0, 4) as usize;
    format!("{ms:.decimals$}")
}

/// Milliseconds of each pass, objects across, in the second column's method.
fn passes(rows: &[ObjectRow]) -> String {
    let shown = |row: &'_ ObjectRow| {
        row.frames.get(1).map_or(Vec::new(), |f| f.passes.iter().map(|p| p.pass.clone()).collect())
    };
    let mut names: Vec<String> = Vec::new();
    for name in rows.iter().flat_map(shown) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    if names.is_empty() {
        return String::new();
    }
    let objects = rows.iter().map(|row| row.object).collect::<Vec<_>>().join(" | ");
    let mut text =
        format!("| pass, ms in {} | {objects} |\n|---|{}\n", COLUMNS[1].name, "---|".repeat(rows.len()));
    for name in names {
        let cell = |row: &ObjectRow| {
            let pass = row.frames[1].passes.iter().find(|p| p.pass == name);
            pass.map_or_else(|| "-".to_owned(), |p| digits(p.ms))
        };
        let cells = rows.iter().map(cell).collect::<Vec<_>>().join(" | ");
        line(&mut text, format_args!("| `{name}` | {cells} |"));
    }
    text
}

fn coverage(rows: &[CoverageRow]) -> String {
    let columns = COLUMNS.map(|c| format!("{}, ms | fixed grid / adaptive", c.name)).join(" | ");
    let mut text =
        format!("| share of the light's view | {columns} |\n|---|{}\n", "---|".repeat(2 * COLUMNS.len()));
    for row in rows {
        let share = 100.0 * row.adaptive.first().map_or(0.0, |f| f.share);
        let cell = |(adaptive, grid): (&Frames, &Frames)| {
            format!("{} | {:.2}", time(adaptive), grid.ms / adaptive.ms)
        };
        let cells = row.adaptive.iter().zip(&row.grid).map(cell).collect::<Vec<_>>().join(" | ");
        line(&mut text, format_args!("| {share:.1} % | {cells} |"));
    }
    text
}

pub(super) fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    writeln!(text, "{arguments}").expect("a String takes everything");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_count() {
        assert_eq!(
            [1234.5, 12.34, 1.234, 0.1234, 0.0].map(digits),
            ["1234", "12.3", "1.23", "0.123", "0.0000"]
        );
    }
}
