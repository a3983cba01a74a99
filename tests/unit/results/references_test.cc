// Trajectories kept for later campaigns: whole, bounded, and safe with several processes at once.
#include "results/store/references.h"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "results/store/trajectory.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

class ReferencesTest : public TempFolderTest {
 protected:
  std::string path(const std::string& name) const { return (dir_ / name).string(); }

  static Trajectory run(double x, size_t states = 3) {
    State state;
    state.bodies.resize(1);
    state.bodies[0].p_WBcm.x() = x;
    return {std::vector<State>(states, state)};
  }
};

TEST_F(ReferencesTest, WhatIsKeptIsThereForAnotherCampaign) {
  const References references(path("kept"));
  EXPECT_FALSE(references.fetch("one", path("first")));
  write_trajectory(path("first"), "one", run(7));
  references.keep("one", path("first"));
  fs::remove_all(path("first"));
  ASSERT_TRUE(references.fetch("one", path("second")));
  const Trajectory found = read_trajectory(path("second"), "one").value_or(Trajectory{});
  ASSERT_EQ(found.states.size(), 3U);
  EXPECT_EQ(found.states.front().bodies[0].p_WBcm.x(), 7);
  EXPECT_FALSE(references.fetch("two", path("second")));
}

// An engine may write to the runs of its results: those are no second names of what is kept, nor of other results.
TEST_F(ReferencesTest, WhatResultsHoldIsTheirs) {
  const References references(path("kept"));
  write_trajectory(path("first"), "one", run(7));
  references.keep("one", path("first"));
  ASSERT_TRUE(references.fetch("one", path("second")));
  for (const char* results : {"first", "second"}) {
    std::fstream file(trajectory_path(path(results), "one"), std::ios::binary | std::ios::in | std::ios::out);
    file << "overwritten";
    ASSERT_TRUE(file.flush());
  }
  ASSERT_TRUE(references.fetch("one", path("third")));
  EXPECT_EQ(read_trajectory(path("third"), "one").value_or(Trajectory{}).states.size(), 3U);
}

TEST_F(ReferencesTest, WithoutAFolderNothingIsKept) {
  const References none("");
  write_trajectory(path("first"), "one", run(7));
  none.keep("one", path("first"));
  none.prune();
  EXPECT_FALSE(none.fetch("one", path("second")));
}

TEST_F(ReferencesTest, AFolderThatCannotBeWrittenCostsTimeAlone) {
  fs::create_directories(dir_);
  std::ofstream(path("file")) << "no folder";
  const References references(path("file") + "/kept");
  write_trajectory(path("first"), "one", run(7));
  references.keep("one", path("first"));
  EXPECT_FALSE(references.fetch("one", path("second")));
}

TEST_F(ReferencesTest, ADamagedFileIsNoReference) {
  const References references(path("kept"));
  write_trajectory(path("first"), "one", run(7));
  references.keep("one", path("first"));
  {
    std::fstream file(trajectory_path(path("kept"), "one"), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(60);
    file.put('!');
  }
  EXPECT_FALSE(references.fetch("one", path("second")));
  EXPECT_FALSE(has_trajectory(path("kept"), "one")) << "it makes room for a whole one";
}

TEST_F(ReferencesTest, TheLongestUnusedGoFirst) {
  write_trajectory(path("first"), "old", run(1));
  const auto bytes = fs::file_size(trajectory_path(path("first"), "old"));
  const References references(path("kept"), 2 * bytes);
  const auto now = fs::file_time_type::clock::now();
  for (const auto& [name, hours] : {std::pair{"old", 3}, std::pair{"used", 2}, std::pair{"new", 1}}) {
    write_trajectory(path("first"), name, run(1));
    references.keep(name, path("first"));
    fs::last_write_time(trajectory_path(path("kept"), name), now - std::chrono::hours(hours));
  }
  ASSERT_TRUE(references.fetch("old", path("second"))) << "which makes it the last used";
  references.prune();
  EXPECT_TRUE(has_trajectory(path("kept"), "old"));
  EXPECT_FALSE(has_trajectory(path("kept"), "used"));
  EXPECT_TRUE(has_trajectory(path("kept"), "new"));
  EXPECT_TRUE(has_trajectory(path("first"), "used")) << "a results directory keeps its own";
}

// Readers see whole files or none, whatever other processes keep, fetch and prune meanwhile.
TEST_F(ReferencesTest, ProcessesShareAFolder) {
  constexpr int kProcesses = 4, kRounds = 60;
  std::vector<pid_t> children;
  for (int process = 0; process < kProcesses; ++process) {
    const pid_t child = ::fork();
    if (child == 0) {
      bool sound = true;
      const References references(path("kept"), 2000);
      for (int round = 0; round < kRounds; ++round) {
        const std::string name = "run" + std::to_string(round % 5);
        const std::string own = path("results" + std::to_string(process) + "-" + std::to_string(round));
        if (references.fetch(name, own)) {
          const auto found = read_trajectory(own, name);
          sound = sound && found && found->states.front().bodies[0].p_WBcm.x() == round % 5;
        } else {
          write_trajectory(own, name, run(round % 5));
          references.keep(name, own);
        }
        references.prune();
        fs::remove_all(own);
      }
      ::_exit(sound ? 0 : 1);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
}

}  // namespace
}  // namespace assay
