// What the subcommands share: how each is registered, and how all of them print, complain and show progress.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <nlohmann/json.hpp>

namespace assay::cli {

using Json = nlohmann::ordered_json;

// Ends the program: 0 done, 1 failed, 2 wrong usage or input.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongInput = 2;

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
void add_report(CLI::App& app, Action& action);
void add_export(CLI::App& app, Action& action);
void add_movie(CLI::App& app, Action& action);
void add_snapshot(CLI::App& app, Action& action);
void add_recommend(CLI::App& app, Action& action);
void add_claims(CLI::App& app, Action& action);
void add_conformance(CLI::App& app, Action& action);

// ---- options --------------------------------------------------------------------------------------------------------

// A subcommand with its examples ("command line", "what it does") below the help.
CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& summary,
                      const std::vector<std::pair<std::string, std::string>>& examples);

// A positive number with or without a fraction bar. Throws InputError that names the option, the value and its unit.
double parse_positive(const std::string& option, const std::string& text, const std::string& unit);

// A whole number from `minimum` to `maximum`.
int parse_count(const std::string& option, const std::string& text, int minimum, int maximum);

// "on" or "off".
bool parse_switch(const std::string& option, const std::string& text);

// "key=value" texts into a map; a key twice is an error.
std::map<std::string, std::string> parse_settings(const std::vector<std::string>& texts);

// ---- output ---------------------------------------------------------------------------------------------------------

// Standard output. Throws SystemError when it cannot be written (a full disk); a closed pipe ends the program by
// SIGPIPE.
void print(const std::string& text);
void print_json(const Json& json);
void flush_output();

// "assay: <text>" on standard error.
void message(const std::string& text);

// The status of `work`, or of what it throws, with its message printed.
int guarded(const std::function<int()>& work);

// "1 body", "2 bodies".
std::string counted(size_t count, const std::string& singular, const std::string& plural);

// Columns under their headings, as wide as they need to be. Columns in `right` hold numbers and are flush right.
std::string table(const std::vector<std::string>& headings, const std::vector<std::vector<std::string>>& rows,
                  const std::vector<size_t>& right = {});

// ---- interruption ---------------------------------------------------------------------------------------------------

// From now on SIGINT and SIGTERM only set the flag that interrupted() returns; with `once`, a second one ends the
// program.
void watch_for_interruption(bool once = true);
bool interrupted();

}  // namespace assay::cli
