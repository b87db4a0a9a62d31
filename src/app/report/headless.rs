//! The report of a saved project without the window: what `sindyscope report PROJECT` writes.

use std::path::Path;
use std::sync::Arc;

use super::Content;
use super::content::{Reported, title};
use crate::app::component::request;
use crate::app::missing::work::subject_of;
use crate::app::open::{self, Opening};
use crate::app::problem::OpeningProblem;
use crate::app::state::{Base, Edit, Source};
use sindyscope_analysis::component::{diagnose_component, identify_component};
use sindyscope_analysis::{AnalysisRequest, MissingRequest};
use sindyscope_core::study::{Cancel, Outcome, Study};
use sindyscope_modes::{BaseModel, analyse};
use sindyscope_search::{Ask, Diagnosis, Found, GapError, Search};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Kind;

/// Opens a project as the window does, and makes everything that its report holds.
///
/// # Errors
/// A file cannot be read or is not where it was, or the study cannot be made.
pub(crate) fn project(path: &Path, command: &str) -> Result<Content, OpeningProblem> {
    let cancel = Cancel::default();
    let opening = Opening::of(Source::Files(vec![path.to_owned()]));
    let opened = open::open(opening, &cancel).map_err(|refused| refused.problem)?;
    let Edit { settings, usage, walk, report, base, component, force, .. } = &opened.document.edit;
    let use_of = |k: usize| usage.get(k).copied().unwrap_or(Usage::Fit);
    let entries = opened.records.iter().enumerate().map(|(k, record)| (Arc::clone(record), use_of(k))).collect();
    let records = RecordSet { entries };
    let failed =
        |problem: String| OpeningProblem::new(problem, "open the project in the window and change its settings");
    let made = |of: Reported| Content {
        title: title(&opened.read.title),
        of,
        arrangement: report.clone(),
        command: Some(command.to_owned()),
    };
    if *component {
        let source = request(&opened.document.reading, force.as_deref());
        let asked = AnalysisRequest { source: source.clone(), ..AnalysisRequest::default() };
        let analysis = identify_component(&asked, &records, &cancel).map_err(|e| failed(e.to_string()))?;
        let asked = MissingRequest::default();
        let search = || diagnose_component(&source, &asked, &records, &|_, _| {}, &cancel);
        let diagnosis = opened.document.beside.component.then(search).transpose().map_err(|e| failed(e.to_string()))?;
        let (analysis, diagnosis) = (Arc::new(analysis), diagnosis.map(Arc::new));
        return Ok(made(Reported::Component { analysis, diagnosis }));
    }
    if base.model == BaseModel::Modes {
        let analysis = analyse(&records, base, &|_, _| {}, &cancel).map_err(|e| failed(e.to_string()))?;
        let kept = opened.document.beside.structure.as_ref().filter(|kept| kept.is_of(&records, base));
        let diagnosis = kept.map(|kept| kept.redrawn(&records, &cancel)).transpose();
        let diagnosis = diagnosis.map_err(|e| failed(e.to_string()))?.map(Arc::new);
        return Ok(made(Reported::Modes { analysis: Arc::new(analysis), diagnosis }));
    }
    let outcome = Study::default().run(&records, settings, &cancel).map_err(|e| failed(e.to_string()))?;
    let found = opened.document.found.as_deref();
    let diagnosis = diagnosed(&records, &outcome, (walk, found), &cancel).map_err(|e| failed(e.to_string()))?;
    Ok(made(Reported::Study { records, outcome: Arc::new(outcome), diagnosis }))
}

/// What the project's walk came to, as it was kept where that is of these records; nothing if none was made.
fn diagnosed(
    records: &RecordSet,
    outcome: &Outcome,
    (walk, found): (&crate::app::Walk, Option<&Found>),
    cancel: &Cancel,
) -> Result<Option<Arc<Diagnosis>>, GapError> {
    if walk.accepted.is_empty() && found.is_none() {
        return Ok(None);
    }
    let identified = || outcome.model.leading().map(|e| e.terms.iter().map(|t| t.term.clone()).collect());
    let base = match &walk.base {
        Base::Typed(terms) => Some(terms.clone()),
        Base::Identified if outcome.model.layout.kind == Kind::SecondOrder => identified(),
        Base::Linear | Base::Identified => None,
    };
    let found = found.filter(|found| found.is_of(&subject_of(records, &walk.own), base.as_deref()));
    let search =
        Search::prepare(records, &Ask { base, effects: walk.own.effects().to_vec(), ..Ask::default() }, cancel)?;
    if let Some(found) = found
        && let Some(mut restored) = search.restore(found, cancel)?
        && let Some(diagnosis) = restored.conclusions.remove(&walk.accepted)
    {
        return Ok(Some(diagnosis));
    }
    if walk.accepted.is_empty() {
        return Ok(None);
    }
    let stages = (0..=walk.accepted.len()).map(|n| search.stage(&walk.accepted[..n], cancel));
    let stages = stages.collect::<Result<Vec<_>, _>>()?;
    search.conclude(Vec::new(), stages, cancel).map(|diagnosis| Some(Arc::new(diagnosis)))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::app::project::Project;
    use crate::app::state::{Document, FoundBeside, RigState, Shown};
    use sindyscope_modes::StructureDiagnosis;
    use sindyscope_rig::{Noise, ScenarioOptions, generate};

    /// Two masses, a cubic spring at the second.
    fn measured(path: &Path) {
        let options = ScenarioOptions {
            parameters: [("n", 2.0), ("place", 2.0), ("cubic", 3e5)].map(|(name, v)| (name.to_owned(), v)).to_vec(),
            measure: Some(vec!["x1".to_owned(), "x2".to_owned()]),
            amplitude: Some(10.0),
            duration: Some(20.0),
            noise: Some(Noise::ShareOfRms(0.01)),
            seed: 1,
            ..ScenarioOptions::default()
        };
        let records = generate("chain", &options).unwrap().records;
        sindyscope_files::write_csv(&records, &mut fs::File::create(path).unwrap(), &[]).unwrap();
    }

    /// The project of a file whose structure was searched, as the window saves it.
    fn searched(data: &Path, project: &Path) -> StructureDiagnosis {
        let mut document = Document::of(Source::Files(vec![data.to_owned()]));
        document.edit.base = sindyscope_modes::Base { model: BaseModel::Modes, ..Default::default() };
        let cancel = Cancel::default();
        let opened = open::open(Opening::of(document.source.clone()), &cancel).map_err(|r| r.problem.what).unwrap();
        let records = RecordSet { entries: opened.records.iter().map(|r| (Arc::clone(r), Usage::Fit)).collect() };
        let found = sindyscope_modes::diagnose(&records, &document.edit.base, &|_, _| {}, &cancel).unwrap();
        document.beside = FoundBeside { structure: Some(Arc::new(found.clone())), component: false };
        Project::new(&document, &[], Shown::default(), RigState::default()).save(project).unwrap();
        found
    }

    #[test]
    fn the_report_of_a_saved_structure_tells_the_force_that_its_search_found() {
        let home = tempfile::tempdir().unwrap();
        let (data, saved) = (home.path().join("two.csv"), home.path().join("two.json"));
        measured(&data);
        let found = searched(&data, &saved);
        let reported = |what: &str| {
            let content = project(&saved, "sindyscope report two.json").map_err(|p| p.what).expect(what);
            let page = home.path().join("two.html");
            content.write(&page).unwrap();
            let Reported::Modes { diagnosis, .. } = content.of else { panic!("no report of modes") };
            (diagnosis, fs::read_to_string(page).unwrap())
        };
        let (diagnosis, page) = reported("the project opens");
        let diagnosis = diagnosis.expect("what was found is kept");
        assert_eq!((diagnosis.verdict(), &diagnosis.found), ("named", &found.found));
        for text in ["Cubic stiffness", "ground-2", "Stabilization diagram"] {
            assert!(page.contains(text), "{text}");
        }
        // What the models leave is not kept but made again, of the same data.
        let [(again, before)] = [(&diagnosis.unseen[0], &found.unseen[0])];
        let rms = |left: &[f64]| (left.iter().map(|e| e * e).sum::<f64>() / left.len() as f64).sqrt();
        let after = |record: &sindyscope_modes::UnseenRecord| record.after.as_ref().map(|a| rms(&a[0])).unwrap();
        assert!((rms(&again.before[0]) / rms(&before.before[0]) - 1.0).abs() < 0.01);
        assert!((after(again) / after(before) - 1.0).abs() < 0.01 && after(again) < 0.6 * rms(&again.before[0]));

        // Of other data it tells nothing.
        let text = fs::read_to_string(&data).unwrap();
        fs::write(&data, text.lines().take(1500).map(|line| format!("{line}\n")).collect::<String>()).unwrap();
        let (diagnosis, page) = reported("the shorter file opens");
        assert!(diagnosis.is_none() && !page.contains("Cubic stiffness") && page.contains("Stabilization diagram"));
    }
}
