// Findings that are known, so that only new ones fail. They are matched by file, kind and subject (Record::subject),
// not by line: an edit elsewhere in a file does not make old findings new.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "check/dataset/dataset.h"

namespace assay::dataset {

class Baseline {
 public:
  // The file of --baseline. Throws InputError for a file that is none, or is of a newer format.
  static Baseline read(const std::string& path);
  // `path` is its name in messages.
  static Baseline parse(const std::string& text, const std::string& path);

  // Sets Record::known of the findings that the baseline has, each as often as it has them. A finding that has become
  // worse since (a "know" that is now to mend) is new.
  void mark(FileReport& report);

  // What mark() has not found, sorted by file.
  std::vector<Known> left() const;
  // Whether mark() has found a file of the baseline, or there is none in it.
  bool is_of_this_folder() const { return files_.empty() || met_; }

 private:
  using Key = std::pair<std::string, std::string>;       // kind, subject
  using OfFile = std::map<Key, std::map<Rank, size_t>>;  // how many of each rank
  std::map<std::string, OfFile> files_;
  bool met_ = false;
};

// The text of a baseline with all these findings; a line each, in a fixed order, so that versions of it compare well.
std::string baseline_text(const std::vector<FileReport>& files);

}  // namespace assay::dataset
