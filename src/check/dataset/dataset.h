// The check of a folder of robots: its files with their findings. What is known of them lies in plain values, so that a
// baseline, SARIF, JUnit and JSON are functions of a Report.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/console.h"
#include "check/dataset/files.h"

namespace assay::dataset {

// How bad a finding is, worst first.
enum class Rank {
  kRefused,  // the file cannot be used as it is
  kMend,     // Level::kMend
  kKnow,     // Level::kKnow, and what --drop-unsupported left out
};
inline constexpr std::array kRanks = {Rank::kRefused, Rank::kMend, Rank::kKnow};
const char* rank_text(Rank rank);  // "refused", "mend", "know"
std::optional<Rank> rank_named(std::string_view name);

// Kinds of findings besides those of check_model().
namespace kinds {
inline constexpr const char* kRefused = "refused";        // a Problem
inline constexpr const char* kLeftOut = "left-out";       // a Problem that an option accepts
inline constexpr const char* kUnreadable = "unreadable";  // the file or folder cannot be read
inline constexpr const char* kCrashed = "crashed";        // its process ended
inline constexpr const char* kTimeLimit = "time-limit";   // its process was stopped
inline constexpr const char* kRepair = "repair";          // the repaired file cannot be written or is refused
}  // namespace kinds

// A finding at one place.
struct Record {
  Rank rank = Rank::kKnow;
  std::string kind = {};     // as docs/guide.md lists them, or one of the above
  std::string element = {};  // "joint 'knee'"; empty for the file as a whole
  int line = 0;              // 0 when it is not known
  std::string file = {};     // the included file that has the line, below the folder; empty for the robot's own
  std::string message = {};  // a sentence without its end
  std::string subject = {};  // what a baseline knows it by: the element, else what the message says without lines
  bool known = false;        // the baseline has it
};

struct Sizes {
  std::string name = {};
  size_t bodies = 0;
  int dof = 0;
  double mass = 0;  // kg
};

// One file, or a folder that could not be listed.
struct FileReport {
  std::string path = {};             // below the folder, as the system names it
  std::string file = {};             // the same as text: UTF-8
  std::optional<Sizes> model = {};   // of a file that is not refused
  std::vector<Record> records = {};  // worst first
  std::vector<std::string> notes = {};
  std::vector<std::string> repairs = {};  // what --repair changed: "line 12: ..."
  std::string repaired = {};              // the file that it wrote; empty for none

  bool has(Rank rank) const;
  // "refused", "mend" or "ok".
  const char* verdict() const;
};

// Findings of a baseline that are alike.
struct Known {
  std::string file = {};
  Rank rank = Rank::kKnow;
  std::string kind = {}, subject = {};
  size_t count = 1;
};

struct KindCount {
  std::string kind = {}, title = {};
  Rank worst = Rank::kKnow;
  size_t findings = 0, files = 0, fresh = 0;  // `fresh`: not of the baseline
};

struct Report {
  std::string folder = {};                                   // as its user named it
  std::vector<FileReport> files = {};                        // sorted by path
  std::map<std::string, std::string> titles = {};            // by kind, of those that were found
  std::vector<std::pair<std::string, std::string>> parts{};  // files that are part of another, and which one
  size_t other_xml = 0;                                      // .xml files that are no MJCF
  std::map<std::string, size_t> not_read = {};               // Listing::others
  size_t links_out = 0;
  bool has_baseline = false;
  std::vector<Known> gone = {};                  // of the baseline, what was not found again
  std::optional<Rank> fail_on = Rank::kRefused;  // the mildest that fails; nothing: none does

  // Whether the command fails because of it.
  bool fails(const Record& record) const;
  size_t failing() const;
  size_t count(const char* verdict) const;
  // Worst kinds first, then by name.
  std::vector<KindCount> kinds() const;
};

// What src/check/README.md describes.
Json report_json(const Report& report);

// A text that a program can be given: bytes that are not UTF-8 become U+FFFD, as JSON has them.
std::string utf8_text(const std::string& bytes);

}  // namespace assay::dataset
