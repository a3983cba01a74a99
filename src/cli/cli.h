// What the subcommands share: how each is registered and how options are read. What they print goes through
// base/console.h.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "base/console.h"
#include "base/exit_status.h"
#include "isolate/interruption.h"

namespace assay::cli {

using exits::kDone, exits::kFailed, exits::kWrongInput;

// What the chosen subcommand does; its result is the program's status. InputError, SystemError and EngineError may
// leave it.
using Action = std::function<int()>;

// One function a subcommand, each in the file of its name. It adds the subcommand, which sets `action` when it is
// called.
void add_engines(CLI::App& app, Action& action);
void add_systems(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_simulate(CLI::App& app, Action& action);
void add_run(CLI::App& app, Action& action);
void add_paper(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_status(CLI::App& app, Action& action);
void add_submit(CLI::App& app, Action& action);
void add_explain(CLI::App& app, Action& action);
void add_import(CLI::App& app, Action& action);
void add_transfer(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_history(CLI::App& app, Action& action);
void add_report(CLI::App& app, Action& action);
void add_export(CLI::App& app, Action& action);
void add_movie(CLI::App& app, Action& action);
void add_snapshot(CLI::App& app, Action& action);
void add_recommend(CLI::App& app, Action& action);
void add_claims(CLI::App& app, Action& action);
void add_parity(CLI::App& app, Action& action);
void add_conformance(CLI::App& app, Action& action);

// ---- options --------------------------------------------------------------------------------------------------------

// A subcommand with its examples ("command line", "what it does") below the help.
using Examples = std::vector<std::pair<std::string, std::string>>;
CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& summary, const Examples& examples);

// A positive number with or without a fraction bar. Throws InputError that names the option, the value and its unit.
double parse_positive(const std::string& option, const std::string& text, const std::string& unit);

// A whole number from `minimum` to `maximum`.
int parse_count(const std::string& option, const std::string& text, int minimum, int maximum);

// "on" or "off".
bool parse_switch(const std::string& option, const std::string& text);

// "key=value" texts into a map; a key twice is an error.
std::map<std::string, std::string> parse_settings(const std::vector<std::string>& texts);

}  // namespace assay::cli
