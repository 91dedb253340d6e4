//! `ivx plan --power`: what the claims that were judged could tell.

use std::io::{self, Write};

use ivx_cache::{Cache, Fetched};
use ivx_engine::{Plan, Source, outputs};
use ivx_grammar::ir::Spec;
use ivx_op::{Artifact as _, Finding, Registry, Verdict, shown_together};

use super::summary::at;
use crate::render::visible;

/// A line for each claim that was judged over seeds, or for each coordinate of it.
pub(super) fn write(
    spec: &Spec,
    plan: &Plan,
    registry: &Registry,
    cache: &Cache,
    out: &mut dyn Write,
) -> io::Result<()> {
    let outputs = outputs(plan, registry, cache);
    let verdict = |source: &Source| {
        let output = outputs[source.node()?.index()].as_ref()?;
        let Ok(Fetched::Bytes(bytes)) = cache.objects().read(output) else { return None };
        Verdict::decode(&bytes)
    };
    let mut unknown = 0;
    for experiment in spec.experiments.iter().filter(|own| !own.claims.is_empty()) {
        writeln!(out, "{}", experiment.name)?;
        for claim in &experiment.claims {
            let family = &plan.outputs[&claim.output.expr];
            let Some(verdict) = family.sources.first().and_then(verdict) else {
                unknown += 1;
                continue;
            };
            for finding in verdict.findings.iter().filter(|finding| finding.p.is_some()) {
                let words = visible(&claim.output.name);
                writeln!(out, "  {:<9} {words}{}", finding.outcome.to_string(), told(finding))?;
            }
        }
    }
    if unknown > 0 {
        writeln!(out, "{unknown} claims are not judged yet: `ivx exec` does that")?;
    }
    Ok(())
}

/// Where it is, the difference seen, the smallest that these seeds tell, and how many tell that seen.
fn told(finding: &Finding) -> String {
    let numbers: Vec<f64> = [finding.estimate].into_iter().chain(finding.smallest).collect();
    let n = finding.n;
    let smallest = match &shown_together(&numbers)[..] {
        [seen, smallest] => format!("difference {seen}, n = {n} tell {smallest}"),
        seen => format!("difference {}, n = {n}", seen.concat()),
    };
    let enough = finding.enough.map(|n| format!("; about {n} seeds tell this"));
    format!("{}  {smallest}{}", at(finding), enough.unwrap_or_default())
}
