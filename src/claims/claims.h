// The paper's findings as data (campaigns/paper_claims.toml) and the verdict of measured results on each.
//
// "The paper" is Erez, Tassa, Todorov: Simulation Tools for Model-Based Robotics: Comparison of Bullet, Havok, MuJoCo,
// ODE and PhysX, ICRA 2015. How each kind of test decides: docs/methodology.md, "Claims".
//
// The file:
//
//   [engines]                              # the paper's line-up, and which of today's contenders stand for it; of
//   "Bullet" = ["bullet-si-f32", ...]      # several the one that does best counts
//
//   [[claim]]
//   number = 1
//   title = "..."                          # a few words
//   statement = "..."                      # one sentence
//   paper = "..."                          # what the paper measured, with its figures and where they stand
//   [[claim.test]]                         # all have to hold
//   kind = "at-timestep"                   # see Test::Kind
//   ...                                    # see Test
//
// As JSON (report_data()'s "claims", `assay claims --json`), in the file's order:
//
//   [{"number": 1, "title": "...", "statement": "...", "paper": "...",
//     "verdict": "holds" | "changed" | "not-measurable",
//     "summary": "...",     one or two sentences with figures; "" when nothing at all was measured
//     "reason": "...",      why it is not measurable; "" when it is
//     "today": "...",       about all contenders of the results, not the paper's alone; "" when there is nothing to say
//     "key": "...",         the figure that decides, in a few words; "" when there is none
//     "figures": [{"label": "ODE / MuJoCo Euler", "contender": "ode-quick", "system": "humanoid",
//                  "timestep_ms": 1 | null, "measure": "step_time", "value": 2.5, "unit": "us" | "1",
//                  "low": 2.4 | null, "high": 2.6 | null}]}]      95 % intervals
//
// A figure with a "/" in its label is the ratio of `measure` of the first engine over the second's, unit "1"; at no
// single timestep (null) where they are compared at equal speed.
#pragma once

namespace assay {}
