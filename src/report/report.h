// The store's content as one HTML file that works offline: tables and plots of every system, the gate, the manifest.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace assay {

class Store;

// Everything the page shows, as plain JSON (web/src/data.ts names the fields). Depends on the results directory alone:
// equal ones give equal bytes. Numbers are finite; what is missing is null.
nlohmann::json report_data(const Store& store);

// The page with `data` inside it, its "replays" in an element of their own behind the page's script. `data` may hold
// any text: it is escaped for a script element.
std::string report_html(const nlohmann::json& data);

// Reads `results_dir`/assay.sqlite and writes the page to `out_file`, whole or not at all. `more` are sections that
// other results than these go into: "changes" (compare/compare.h) and "history" (compare/history.h). Throws InputError
// when `results_dir` holds no results (or those of another version), SystemError when `out_file` cannot be written.
void write_report(const std::string& results_dir, const std::string& out_file);
void write_report(const std::string& results_dir, const std::string& out_file, const nlohmann::json& more);

}  // namespace assay
