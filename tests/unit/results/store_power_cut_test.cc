// A power cut while a results directory is written: no finished cell is lost, and nothing wrong is read.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <sstream>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "base/errors.h"
#include "base/hash.h"
#include "message_of.h"
#include "reliability.h"
#include "results/store/merge.h"
#include "results/store/references.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"
#include "store_faults.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// A disk that keeps what was synced, and any part of what was not. All files are written through to the real system;
// beside that, what a power cut would leave is known at each moment.
class Disk {
 public:
  struct Write {
    sqlite3_int64 offset = 0;
    std::string bytes;
    bool truncates = false;
  };
  struct Image {
    std::string durable;
    std::vector<Write> pending;
  };

  static void apply(std::string& image, const Write& write) {
    const auto offset = static_cast<size_t>(write.offset);
    if (write.truncates) {
      image.resize(offset);
      return;
    }
    if (image.size() < offset + write.bytes.size()) image.resize(offset + write.bytes.size());
    std::ranges::copy(write.bytes, image.begin() + static_cast<std::ptrdiff_t>(offset));
  }

  void note(const std::string& path, Write write) {
    files[path].pending.push_back(std::move(write));
    if (on_operation) on_operation();
  }
  void sync(const std::string& path) {
    Image& image = files[path];
    for (const Write& write : image.pending) apply(image.durable, write);
    image.pending.clear();
    if (on_operation) on_operation();
  }

  // What is there after a power cut now: of writes that were not synced any subset, sector by sector.
  std::map<std::string, std::string> after_power_cut(std::mt19937& random) const {
    constexpr size_t kSector = 512;
    std::map<std::string, std::string> left;
    for (const auto& [path, image] : files) {
      std::string content = image.durable;
      for (const Write& write : image.pending) {
        if (write.truncates) {
          if ((random() & 1U) != 0) apply(content, write);
          continue;
        }
        for (size_t at = 0; at < write.bytes.size(); at += kSector) {
          if ((random() & 1U) == 0) continue;
          apply(content, {write.offset + static_cast<sqlite3_int64>(at), write.bytes.substr(at, kSector), false});
        }
      }
      left[path] = content;
    }
    return left;
  }

  std::map<std::string, Image> files;
  std::function<void()> on_operation;
};

Disk* disk = nullptr;
sqlite3_vfs* real_vfs = nullptr;

// NOLINTBEGIN: SQLite's interface is C
struct RecordedFile {
  sqlite3_file base;
  char path[1024];
  // the real file follows
};
sqlite3_file* real_of(sqlite3_file* file) {
  return reinterpret_cast<sqlite3_file*>(reinterpret_cast<RecordedFile*>(file) + 1);
}
std::string path_of(sqlite3_file* file) { return reinterpret_cast<RecordedFile*>(file)->path; }

const sqlite3_io_methods kMethods = {
    2,
    [](sqlite3_file* f) { return real_of(f)->pMethods->xClose(real_of(f)); },
    [](sqlite3_file* f, void* to, int n, sqlite3_int64 at) {
      return real_of(f)->pMethods->xRead(real_of(f), to, n, at);
    },
    [](sqlite3_file* f, const void* from, int n, sqlite3_int64 at) {
      disk->note(path_of(f), {at, std::string(static_cast<const char*>(from), static_cast<size_t>(n)), false});
      return real_of(f)->pMethods->xWrite(real_of(f), from, n, at);
    },
    [](sqlite3_file* f, sqlite3_int64 size) {
      disk->note(path_of(f), {size, "", true});
      return real_of(f)->pMethods->xTruncate(real_of(f), size);
    },
    [](sqlite3_file* f, int flags) {
      disk->sync(path_of(f));
      return real_of(f)->pMethods->xSync(real_of(f), flags);
    },
    [](sqlite3_file* f, sqlite3_int64* size) { return real_of(f)->pMethods->xFileSize(real_of(f), size); },
    [](sqlite3_file* f, int lock) { return real_of(f)->pMethods->xLock(real_of(f), lock); },
    [](sqlite3_file* f, int lock) { return real_of(f)->pMethods->xUnlock(real_of(f), lock); },
    [](sqlite3_file* f, int* out) { return real_of(f)->pMethods->xCheckReservedLock(real_of(f), out); },
    [](sqlite3_file* f, int op, void* arg) { return real_of(f)->pMethods->xFileControl(real_of(f), op, arg); },
    [](sqlite3_file* f) { return real_of(f)->pMethods->xSectorSize(real_of(f)); },
    [](sqlite3_file* f) { return real_of(f)->pMethods->xDeviceCharacteristics(real_of(f)); },
    [](sqlite3_file* f, int region, int size, int extend, void volatile** to) {
      return real_of(f)->pMethods->xShmMap(real_of(f), region, size, extend, to);
    },
    [](sqlite3_file* f, int offset, int n, int flags) {
      return real_of(f)->pMethods->xShmLock(real_of(f), offset, n, flags);
    },
    [](sqlite3_file* f) { real_of(f)->pMethods->xShmBarrier(real_of(f)); },
    [](sqlite3_file* f, int remove) { return real_of(f)->pMethods->xShmUnmap(real_of(f), remove); },
    nullptr,
    nullptr};

int open_recorded(sqlite3_vfs* /*vfs*/, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  auto* recorded = reinterpret_cast<RecordedFile*>(file);
  std::memset(recorded, 0, sizeof *recorded);
  std::snprintf(recorded->path, sizeof recorded->path, "%s", name == nullptr ? "temporary" : name);
  const int code = real_vfs->xOpen(real_vfs, name, real_of(file), flags, out_flags);
  recorded->base.pMethods = real_of(file)->pMethods == nullptr ? nullptr : &kMethods;
  return code;
}

int delete_recorded(sqlite3_vfs* /*vfs*/, const char* name, int sync_dir) {
  disk->files.erase(name);
  return real_vfs->xDelete(real_vfs, name, sync_dir);
}
// NOLINTEND

class RecordingDisk {
 public:
  explicit RecordingDisk(Disk& recorded) : vfs_(*sqlite3_vfs_find(nullptr)) {
    disk = &recorded;
    real_vfs = sqlite3_vfs_find(nullptr);
    vfs_.zName = "recorded";
    vfs_.szOsFile = static_cast<int>(sizeof(RecordedFile)) + real_vfs->szOsFile;
    vfs_.xOpen = open_recorded;
    vfs_.xDelete = delete_recorded;
    sqlite3_vfs_register(&vfs_, 1);
  }
  ~RecordingDisk() {
    sqlite3_vfs_unregister(&vfs_);
    sqlite3_vfs_register(real_vfs, 1);
  }
  RecordingDisk(const RecordingDisk&) = delete;
  RecordingDisk& operator=(const RecordingDisk&) = delete;

 private:
  sqlite3_vfs vfs_{};
};

TEST_F(StoreFaultsTest, APowerCutLosesNoFinishedCell) {
  constexpr int kCells = 60, kSamples = 400;
  const unsigned seed = std::random_device{}();
  std::mt19937 random(seed);
  std::vector<std::pair<fs::path, int>> cuts;  // what is left, and how many cells were finished
  {
    Disk recorded;
    int finished = 0;
    recorded.on_operation = [&] {
      constexpr unsigned kOneIn = 12;
      if (random() % kOneIn != 0) return;
      const fs::path folder = dir_ / fmt::format("cut{}", cuts.size());
      fs::create_directories(folder);
      for (const auto& [path, content] : recorded.after_power_cut(random)) {
        write_bytes(folder / fs::path(path).filename(), content);
      }
      cuts.emplace_back(folder, finished);
    };
    const RecordingDisk recording(recorded);
    Store store = Store::create(dir(), kCampaign);
    for (int i = 0; i < kCells; ++i) {
      store.put_cell(numbered_cell(i), numbered_samples(i, kSamples));
      finished = i + 1;
    }
  }
  ASSERT_GT(cuts.size(), 20U);
  for (const auto& [folder, finished] : cuts) {
    SCOPED_TRACE(fmt::format("{}, seed {}", folder.string(), seed));
    Store store = Store::create(folder, kCampaign);
    const std::vector<Cell> cells = store.cells();
    EXPECT_GE(std::ssize(cells), finished);
    for (const Cell& cell : cells) {
      const int number = static_cast<int>(cell.timestep_ms) - 1;
      EXPECT_EQ(cell.values.at(0).value, 1e-5 * (1 + number));
      EXPECT_EQ(store.samples(cell.id).at(0).values, numbered_samples(number, kSamples).at(0).values);
    }
    store.put_cell(numbered_cell(kCells));
  }
  reliability("a power cut while cells are stored (unsynced sectors are lost at random)", static_cast<int>(cuts.size()),
              "the same command goes on", "no finished cell");
}

}  // namespace
}  // namespace assay
