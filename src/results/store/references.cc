#include "results/store/references.h"

#include <algorithm>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/regular_file.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// No second name for the file: an engine may write to the runs of its results, and these are not to be others', too.
// Whole or not at all.
bool copy_whole(const std::string& from, const std::string& to) {
  if (!other_than_file(from).empty()) return false;
  std::error_code error;
  if (fs::exists(to, error)) return true;
  const std::string temporary = fmt::format("{}.{}.tmp", to, ::getpid());
  fs::remove(temporary, error);  // a link that lies there is not followed
  fs::copy_file(from, temporary, error);
  if (!error) fs::rename(temporary, to, error);
  if (error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
  }
  return !error;
}

}  // namespace

References::References(std::string dir, std::uintmax_t most_bytes) : dir_(std::move(dir)), most_bytes_(most_bytes) {}

bool References::fetch(const std::string& address, const std::string& results) const {
  if (dir_.empty() || !has_trajectory(dir_, address)) return false;
  const std::string kept = trajectory_path(dir_, address);
  const auto trajectory = read_trajectory(dir_, address);
  if (!trajectory || trajectory->states.empty() || !trajectory_fault(dir_, address).empty()) {
    std::error_code error;
    fs::remove(kept, error);
    return false;
  }
  ::utimensat(AT_FDCWD, kept.c_str(), nullptr, 0);  // used now
  std::error_code error;
  fs::create_directories(results, error);
  if (copy_whole(kept, trajectory_path(results, address))) return true;
  write_trajectory(results, address, *trajectory);  // says what is wrong with the folder
  return true;
}

void References::keep(const std::string& address, const std::string& results) const {
  if (dir_.empty() || has_trajectory(dir_, address) || !has_trajectory(results, address)) return;
  if (!trajectory_fault(results, address).empty()) return;
  std::error_code error;
  fs::create_directories(dir_, error);
  if (!error) copy_whole(trajectory_path(results, address), trajectory_path(dir_, address));
}

void References::prune() const {
  struct File {
    fs::file_time_type used;
    std::uintmax_t bytes = 0;
    fs::path path;
  };
  std::vector<File> files;
  std::uintmax_t total = 0;
  std::error_code error;
  if (dir_.empty()) return;
  for (fs::directory_iterator it(dir_, error), end; !error && it != end; it.increment(error)) {
    // Another process may remove it meanwhile: then it counts for nothing.
    std::error_code gone;
    if (it->path().extension() != ".bin" || !it->is_regular_file(gone)) continue;
    const File file{it->last_write_time(gone), it->file_size(gone), it->path()};
    if (gone) continue;
    total += file.bytes;
    files.push_back(file);
  }
  std::ranges::sort(files, {}, &File::used);
  for (const File& file : files) {
    if (total <= most_bytes_) break;
    std::error_code gone;
    fs::remove(file.path, gone);
    total -= file.bytes;
  }
}

}  // namespace assay
