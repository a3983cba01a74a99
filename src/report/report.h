// The store's content as one HTML file that works offline: tables and plots of every system, the gate, the manifest.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace assay {

class Store;

// Of the layout of the page's JSON, which web/src/data.ts describes.
inline constexpr int kReportFormat = 4;

// What a report shows of results that are too large for one page.
struct ReportOptions {
  std::vector<std::string> systems = {};  // that it may show; empty: all
  // Of the page, which keeps to it unless one system alone is larger. Beyond it digits of values after the sixth go
  // first, then the distributions of samples. Where systems would have to go too, replays give way first (each names
  // what it lacks), down to a tenth of their room; then go the systems for which there is no room with those before.
  // Claims are judged by all results. An entry "left_out" of the page's manifest says what it was.
  size_t most_bytes = 10'000'000;
};

// Everything the page shows, as plain JSON (web/src/data.ts names the fields). Depends on the results directory and the
// options alone: equal ones give equal bytes. Numbers are finite; what is missing is null. Throws InputError for a
// system that the results do not have.
nlohmann::json report_data(const Store& store, const ReportOptions& options = {});

// The page with `data` inside it, its "replays" in an element of their own behind the page's script. `data` may hold
// any text: it is escaped for a script element.
std::string report_html(const nlohmann::json& data);

// Reads `results_dir`/assay.sqlite and writes the page to `out_file`, whole or not at all. `more` are sections that
// other results than these go into: "changes" (results/compare/compare.h) and "history" (results/compare/history.h).
// Throws InputError when `results_dir` holds no results (or those of another version), SystemError when `out_file`
// cannot be written.
void write_report(const std::string& results_dir, const std::string& out_file);
// Returns what was left out, and that the page is larger than asked where it is; "" for nothing.
std::string write_report(const std::string& results_dir, const std::string& out_file, const nlohmann::json& more,
                         const ReportOptions& options = {});

}  // namespace assay
