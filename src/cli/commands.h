// One function a subcommand, each in the file of its name.
#pragma once

#include "cli/cli.h"

namespace assay::cli {

void add_list(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_parity(CLI::App& app, Action& action);
void add_conformance(CLI::App& app, Action& action);
void add_convert(CLI::App& app, Action& action);
void add_import(CLI::App& app, Action& action);
void add_simulate(CLI::App& app, Action& action);
void add_run(CLI::App& app, Action& action);
void add_paper(CLI::App& app, Action& action);
void add_submit(CLI::App& app, Action& action);
void add_status(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_recommend(CLI::App& app, Action& action);
void add_explain(CLI::App& app, Action& action);
void add_match(CLI::App& app, Action& action);
void add_bisect(CLI::App& app, Action& action);
void add_report(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_history(CLI::App& app, Action& action);
void add_export(CLI::App& app, Action& action);
void add_draw(CLI::App& app, Action& action);
void add_engines(CLI::App& app, Action& action);
void add_systems(CLI::App& app, Action& action);
void add_snapshot(CLI::App& app, Action& action);
void add_movie(CLI::App& app, Action& action);
void add_transfer(CLI::App& app, Action& action);
void add_claims(CLI::App& app, Action& action);

}  // namespace assay::cli
