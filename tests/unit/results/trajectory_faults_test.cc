// Trajectories that are damaged, swapped, forged or links: nothing wrong is read.
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
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Trajectory moving(int states, int bodies, double offset) {
  Trajectory trajectory;
  for (int i = 0; i < states; ++i) {
    State state;
    state.time = 0.1 * i;
    state.bodies.resize(static_cast<size_t>(bodies));
    for (BodyState& body : state.bodies) body.p_WBcm = Vec3(offset, i, 0);
    state.position = {0.1};
    state.velocity = {0.2};
    trajectory.states.push_back(state);
  }
  return trajectory;
}

TEST_F(StoreFaultsTest, ASwappedTrajectoryIsRefusedByName) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  write_trajectory(dir(), "bbbb", moving(5, 2, 1));
  fs::rename(trajectory_path(dir(), "aaaa"), trajectory_path(dir(), "x"));
  fs::rename(trajectory_path(dir(), "bbbb"), trajectory_path(dir(), "aaaa"));
  fs::rename(trajectory_path(dir(), "x"), trajectory_path(dir(), "bbbb"));
  EXPECT_FALSE(read_trajectory(dir(), "aaaa"));
  EXPECT_EQ(trajectory_fault(dir(), "aaaa"), "holds the run bbbb");
  EXPECT_EQ(count_states(dir(), "aaaa"), 0U);
  const References references(dir());
  EXPECT_FALSE(references.fetch("bbbb", dir("other"))) << "not for another campaign either";
}

TEST_F(StoreFaultsTest, EveryDamageOfATrajectoryIsFound) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  const fs::path path = trajectory_path(dir(), "aaaa");
  const std::string whole = bytes_of(path);
  int tries = 0;
  for (size_t at = 0; at < whole.size(); at += 7, ++tries) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    write_bytes(path, damaged);
    EXPECT_FALSE(read_trajectory(dir(), "aaaa")) << at;
    EXPECT_FALSE(trajectory_fault(dir(), "aaaa").empty()) << at;
  }
  for (size_t size = 0; size < whole.size(); size += 13, ++tries) {
    write_bytes(path, whole.substr(0, size));
    EXPECT_FALSE(read_trajectory(dir(), "aaaa")) << size;
  }
  reliability("a trajectory is cut off, a bit of it changes, or it is another run's", tries + 2,
              "refused by name; made again at the next start", "the time of that run");
}

// With a checksum that is right.
TEST_F(StoreFaultsTest, AForgedTrajectoryIsRefused) {
  const auto forged = [&](std::uint64_t states, std::uint64_t bodies, std::uint64_t joints,
                          const std::string& numbers) {
    std::string bytes = "assay-trajectory-2\n";
    const auto put = [&](std::uint64_t number) { bytes.append(reinterpret_cast<const char*>(&number), sizeof number); };
    put(4);
    bytes += "aaaa";
    for (const std::uint64_t count : {states, bodies, joints}) put(count);
    bytes += numbers;
    fs::create_directories(dir());
    write_bytes(trajectory_path(dir(), "aaaa"), bytes + content_hash(bytes));
    return trajectory_fault(dir(), "aaaa");
  };
  constexpr std::uint64_t kHuge = std::uint64_t{1} << 61;
  constexpr size_t kState = 14 * sizeof(double);  // of one body
  EXPECT_THAT(forged(kHuge, 0, 0, ""), StartsWith("is damaged"));
  EXPECT_THAT(forged(1, kHuge, kHuge, std::string(8, '\0')), StartsWith("is damaged"));
  EXPECT_THAT(forged(2, 1, 0, std::string(kState, '\0')), StartsWith("is damaged"));
  EXPECT_THAT(forged(1, 1, 0, std::string(kState, '\0')), HasSubstr("an orientation of length 0"));
  EXPECT_THAT(forged(1, 1, 0, std::string(kState, '\xff')), HasSubstr("a non-finite number"));
  // each would take some 80 bytes of memory
  EXPECT_THAT(forged(1000, 0, 0, std::string(8000, '\0')), HasSubstr("states of no bodies"));
  EXPECT_FALSE(read_trajectory(dir(), "aaaa"));
}

// What pictures, replays and exports index and divide by.
TEST_F(StoreFaultsTest, ARunIsOfItsSystemAndItsTimesIncrease) {
  const auto fault = [](Trajectory run, const std::function<void(std::vector<State>&)>& work) {
    work(run.states);
    return run_fault(run, 2, 1);
  };
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto&) {}), "");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states.resize(1); }), "");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states.clear(); }), "has no states");
  EXPECT_EQ(fault(moving(5, 3, 0), [](auto&) {}), "is another system's");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[4].bodies.pop_back(); }), "is another system's");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[4].position.clear(); }), "is another system's");
  EXPECT_EQ(run_fault(moving(5, 2, 0), 2), "") << "where the joints are not known";
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[3].time = states[2].time; }),
            "has times that do not increase");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[4].time = 1e12; }), "has times that no run reaches");
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  EXPECT_TRUE(read_run(dir(), "aaaa", 2, 1));
  EXPECT_FALSE(read_run(dir(), "aaaa", 2, 2));
  EXPECT_FALSE(read_run(dir(), "aaaa", 1));
}

// Instead of a run's file: nothing is waited for, and no memory is taken for what is no run.
TEST_F(StoreFaultsTest, ATrajectoryThatIsNoFileOrFarTooLargeIsDamaged) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  const fs::path path = trajectory_path(dir(), "aaaa");
  const std::string whole = bytes_of(path);
  constexpr std::uintmax_t kGiB = std::uintmax_t{1} << 30;
  const std::vector<std::pair<std::string, std::function<void()>>> others = {
      {"a named pipe", [&] { ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0); }},
      {"a device", [&] { fs::create_symlink("/dev/zero", path); }},
      {"a directory", [&] { fs::create_directory(path); }},
      {"102400 MiB",
       [&] {
         write_bytes(path, whole);
         fs::resize_file(path, 100 * kGiB);
       }},
      {"its size is not that of its states",
       [&] {
         write_bytes(path, whole);
         fs::resize_file(path, 3 * kGiB);
       }},
      {"does not begin as a trajectory", [&] {
         write_bytes(path, "");
         fs::resize_file(path, 3 * kGiB);
       }}};
  for (const auto& [what, make] : others) {
    SCOPED_TRACE(what);
    fs::remove_all(path);
    make();
    EXPECT_TRUE(has_trajectory(dir(), "aaaa"));
    EXPECT_FALSE(read_trajectory(dir(), "aaaa"));
    EXPECT_THAT(trajectory_fault(dir(), "aaaa"), AllOf(StartsWith("is damaged"), HasSubstr(what)));
    EXPECT_EQ(count_states(dir(), "aaaa"), 0U);
    const References kept(dir("kept"));
    kept.keep("aaaa", dir());
    EXPECT_FALSE(kept.fetch("aaaa", dir("other")));
  }
  reliability("a run's file is a pipe, a device, a folder, or has 100 GiB", static_cast<int>(others.size()),
              "damaged: named, and the others are read", "the time of that run");
}

// What a link means may be a file that is not to be shared.
TEST_F(StoreFaultsTest, AMergeTakesNoFilesThroughLinks) {
  fill(dir(), 2, 2);
  write_bytes(dir_ / "secret", "mine");
  for (const char* folder : {"trajectories/x.bin", "parity/x.json"}) {
    const fs::path path = fs::path(dir()) / folder;
    fs::create_directories(path.parent_path());
    fs::create_symlink(dir_ / "secret", path);
    fs::remove_all(dir("union"));
    EXPECT_THAT(message_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); }),
                AllOf(HasSubstr(path.string()), HasSubstr("a symbolic link"), HasSubstr("remove it")));
    fs::remove(path);
  }
}

TEST_F(StoreFaultsTest, TrajectoriesOfTheOlderFormatAreReadAndNotMeasuredFrom) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  std::string bytes = bytes_of(trajectory_path(dir(), "aaaa"));
  bytes = bytes.substr(0, bytes.size() - 32);
  bytes.replace(0, std::strlen("assay-trajectory-2\n") + 8 + 4, "assay-trajectory-1\n");
  write_bytes(trajectory_path(dir(), "aaaa"), bytes + content_hash(bytes));
  EXPECT_TRUE(read_trajectory(dir(), "aaaa"));
  EXPECT_EQ(count_states(dir(), "aaaa"), 5U);
  EXPECT_THAT(trajectory_fault(dir(), "aaaa"), HasSubstr("older format"));
}

}  // namespace
}  // namespace assay
