// Campaigns as a whole, with real engines and with one that fails as it is told to: outcomes, resuming, faults.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include "base/errors.h"
#include "base/paths.h"
#include "cell_values.h"
#include "conformance/conformance.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "measures/step_time.h"
#include "reliability.h"
#include "results/store/timing_samples.h"
#include "results/store/trajectory.h"
#include "run/coordinator/rerun.h"
#include "run/coordinator/run.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

// The program beside the tests', as a user's campaign starts it.
std::string program() { return (fs::path(program_path()).parent_path() / "assay").string(); }

// Workers find the engine of mishaps, and so does this process, whose registry is made at its first use.
const bool kMishapIsFound = [] {
  const std::string folder = (fs::path(program_path()).parent_path().parent_path() / "tests/mishap").string();
  // A sanitizer must not turn a worker's crash into an exit.
  const char* const given = std::getenv("ASAN_OPTIONS");
  const std::string sanitizer = given ? fmt::format("{}:handle_segv=0", given) : "handle_segv=0";
  return ::setenv("ASSAY_ENGINE_PATH", folder.c_str(), 1) == 0 && ::setenv("ASAN_OPTIONS", sanitizer.c_str(), 1) == 0;
}();

class RunsTest : public TempFolderTest {
 public:
  RunsTest() { EXPECT_TRUE(kMishapIsFound); }

 protected:
  std::string dir(const std::string& name = "out") const { return (dir_ / name).string(); }

  static RunOptions options(const std::string& out) {
    RunOptions options;
    options.out = out;
    options.jobs = 2;
    options.program = program();
    return options;
  }

  // The conformance suite has tests of its own; here its results are stored beforehand.
  static void pass_gate(const Campaign& campaign, const std::string& out) {
    Store store = Store::create(out, {campaign.name, campaign.hash()});
    for (const CampaignContender& contender : campaign.contenders) {
      store.set_conformance(contender.resolved.name, {{"", "free-fall", "pass", 0, 1, "", ""}});
    }
  }

  static RunSummary run_scored(const Campaign& campaign, const std::string& out) {
    pass_gate(campaign, out);
    return run_campaign(campaign, options(out));
  }
};

Campaign faulty_campaign(const std::string& fault, const std::string& more = "",
                         const std::string& measures = R"("drift")") {
  const std::string limit_s = fault == "flood" ? "60" : "2";  // what is to be seen before time is up
  return parse_campaign("name = \"faults\"\ntime_limit_s = " + limit_s +
                            "\ntimesteps_ms = [1, 4]\nreference_ms = 1\nmeasures = [" + measures +
                            "]\n[timing]\nrounds = 3\nbatch_ms = 1\n"
                            "[[contender]]\nname = \"sound\"\nbase = \"mishap\"\n"
                            "[[contender]]\nname = \"broken\"\nbase = \"mishap\"\nset = {fault = \"" +
                            fault + "\"" + more +
                            "}\n[[system]]\nname = \"planar-chain\"\nduration_s = 0.128\npiece_ms = 64\n",
                        "faults.toml");
}

Cell find(const Store& store, const std::string& contender, const std::string& measure, double timestep_ms) {
  for (const Cell& cell : store.cells()) {
    if (cell.contender == contender && cell.measure == measure && cell.timestep_ms == timestep_ms) return cell;
  }
  ADD_FAILURE() << "no cell " << contender << " " << measure << " " << timestep_ms;
  return {};
}

// What must not depend on how often the campaign was stopped: all but times, speeds and the run of the identifiers.
std::string table(const std::string& dir) {
  const Store store = Store::open(dir);
  std::ostringstream out;
  out.precision(17);
  for (const Cell& cell : store.cells()) {
    out << cell.key << ' ' << cell.system << ' ' << cell.contender << ' ' << cell.measure << ' ' << cell.timestep_ms
        << ' ' << outcome_text(cell.outcome) << ' ' << cell.reason;
    for (const Value& each : cell.values) {
      out << ' ' << each.name;
      if (cell.measure != "raw_speed") out << '=' << each.value.value_or(-1) << '/' << each.low.value_or(-1);
    }
    if (cell.measure != "raw_speed") {
      for (const SampleSeries& series : store.samples(cell.id)) {
        for (const double sample : series.values) out << ' ' << sample;
      }
    }
    out << '\n';
  }
  return out.str();
}

// ---- faults -----------------------------------------------------------------------------------------------------------

struct Fault {
  std::string name;
  Outcome outcome;
  std::string reason;
};

// Else ctest shows the bytes, which differ each time.
// NOLINTNEXTLINE(readability-identifier-naming): the name is GoogleTest's
void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

// NOLINTNEXTLINE(misc-multiple-inheritance): GoogleTest's way to a parameter
class FaultTest : public RunsTest, public ::testing::WithParamInterface<Fault> {};

// A fault takes its own cell and no other; the campaign goes on to its end.
TEST_P(FaultTest, IsAnOutcomeWithAReason) {
  const Campaign campaign = faulty_campaign(GetParam().name);
  const RunSummary summary = run_scored(campaign, dir());
  EXPECT_EQ(summary.cells, 4);
  EXPECT_EQ(summary.done_now, 4);
  EXPECT_FALSE(summary.interrupted);
  const Store store = Store::open(dir());
  for (const double timestep : {1.0, 4.0}) {
    EXPECT_EQ(find(store, "sound", "drift", timestep).outcome, Outcome::kOk);
    const Cell broken = find(store, "broken", "drift", timestep);
    EXPECT_EQ(outcome_text(broken.outcome), outcome_text(GetParam().outcome)) << broken.reason;
    EXPECT_THAT(broken.reason, HasSubstr(GetParam().reason));
    EXPECT_EQ(value(broken, "energy_drift").has_value(),
              GetParam().outcome == Outcome::kUnstable || GetParam().outcome == Outcome::kOk);
  }
  if (GetParam().outcome == Outcome::kOk) return;
  reliability(fmt::format("an engine's fault: {}", GetParam().name), 2,
              fmt::format("{}: {}", outcome_text(GetParam().outcome), GetParam().reason), "that cell");
}

// The C library aborts on a heap that was damaged; the address sanitizer sees the damage first and exits.
#ifdef __SANITIZE_ADDRESS__
const char* const kHeapFault = "exit status 1";
#else
const char* const kHeapFault = "signal 6";
#endif

INSTANTIATE_TEST_SUITE_P(
    Faults, FaultTest,
    ::testing::Values(
        Fault{"crash", Outcome::kCrashed, "signal 11"}, Fault{"abort", Outcome::kCrashed, "signal 6"},
        Fault{"exit", Outcome::kCrashed, "exit status 3"}, Fault{"exit-as-if-done", Outcome::kCrashed, "exit status 0"},
        Fault{"exit-at-once", Outcome::kCrashed, "exit status 0"}, Fault{"terminate", Outcome::kCrashed, "signal 6"},
        Fault{"free-twice", Outcome::kCrashed, kHeapFault}, Fault{"write-beyond", Outcome::kCrashed, kHeapFault},
        Fault{"overflow", Outcome::kCrashed, "signal 11"}, Fault{"loop", Outcome::kTimeout, "not done after 2 s"},
        Fault{"hang", Outcome::kTimeout, "not done after 2 s"}, Fault{"nan", Outcome::kDiverged, "non-finite"},
        Fault{"far", Outcome::kDiverged, "1e+09 m away"}, Fault{"fast", Outcome::kUnstable, "kinetic energy"},
        Fault{"throw", Outcome::kDiverged, "the solver gave up"},
        Fault{"throw-foreign", Outcome::kCrashed, "not an engine's error"},
        Fault{"throw-number", Outcome::kCrashed, "no std::exception"},
        Fault{"throw-input", Outcome::kCrashed, "the user is to blame"},
        Fault{"throw-system", Outcome::kCrashed, "the machine is to blame"},
        Fault{"throw-in-create", Outcome::kCrashed, "no more in create"},
        Fault{"throw-in-read", Outcome::kCrashed, "no more in read"},
        Fault{"exit-in-create", Outcome::kCrashed, "exit status 0"},
        Fault{"exit-in-read", Outcome::kCrashed, "exit status 0"}, Fault{"chatter", Outcome::kOk, ""},
        Fault{"garble", Outcome::kCrashed, "something other than the worker wrote"},
        Fault{"forge", Outcome::kCrashed, "something other than the worker wrote"},
        Fault{"forge-done", Outcome::kCrashed, "something other than the worker wrote"},
        Fault{"forge-tests", Outcome::kCrashed, "something other than the worker wrote"},
        Fault{"flood", Outcome::kCrashed, "longer than 64 MiB"},
        Fault{"wrong-size", Outcome::kCrashed, "the engine gave 4 bodies where the model has 5"},
        Fault{"backward", Outcome::kCrashed, "was asked for"},
        Fault{"nan-time", Outcome::kDiverged, "the engine gave a non-finite number"},
        Fault{"nan-angle", Outcome::kDiverged, "the engine gave a non-finite number"},
        Fault{"zero-orientation", Outcome::kDiverged, "the engine gave an orientation of length 0"},
        Fault{"refuse", Outcome::kUnsupported, "give it to somebody else"}),
    [](const auto& test) {
      std::string name = test.param.name;
      std::ranges::replace(name, '-', '_');
      return name;
    });

TEST_F(RunsTest, ACrashSaysWhatWasPrintedLast) {
  run_scored(faulty_campaign("abort", ", loud = true"), dir());
  EXPECT_THAT(find(Store::open(dir()), "broken", "drift", 1).reason, HasSubstr("about to abort"));
}

TEST_F(RunsTest, OnlyTheTimestepsThatFailAreLost) {
  run_scored(faulty_campaign("nan", ", from_ms = 2.0", R"("consistency", "truth", "drift")"), dir());
  const Store store = Store::open(dir());
  for (const char* measure : {"consistency", "truth", "drift"}) {
    EXPECT_EQ(find(store, "broken", measure, 1).outcome, Outcome::kOk) << measure;
    EXPECT_EQ(find(store, "broken", measure, 4).outcome, Outcome::kDiverged) << measure;
  }
}

TEST_F(RunsTest, WhatNeedsAFailedReferenceFailsWithIt) {
  const Campaign campaign = faulty_campaign("crash", "", R"("consistency", "raw_speed")");
  run_scored(campaign, dir());
  const Store store = Store::open(dir());
  EXPECT_EQ(find(store, "broken", "reference", 1).outcome, Outcome::kCrashed);
  for (const char* measure : {"consistency", "raw_speed"}) {
    const Cell cell = find(store, "broken", measure, 4);
    EXPECT_EQ(cell.outcome, Outcome::kCrashed) << measure;
    EXPECT_THAT(cell.reason, AllOf(StartsWith("its reference run: "), HasSubstr("signal 11")));
    EXPECT_EQ(find(store, "sound", measure, 4).outcome, Outcome::kOk);
  }
}

// In a timing session a worker that dies is replaced for the next timestep.
TEST_F(RunsTest, FaultsWhileTiming) {
  for (const auto& [fault, outcome] : {std::pair{"crash", Outcome::kCrashed}, std::pair{"hang", Outcome::kTimeout},
                                       std::pair{"nan", Outcome::kDiverged}, std::pair{"garble", Outcome::kCrashed},
                                       std::pair{"forge", Outcome::kCrashed}}) {
    const std::string out = dir(fault);
    // The reference at 1 ms is sound; what is timed at 1 ms too.
    run_scored(faulty_campaign(fault, ", from_ms = 2.0, at_step = 3", R"("raw_speed")"), out);
    const Store store = Store::open(out);
    EXPECT_EQ(find(store, "broken", "raw_speed", 1).outcome, Outcome::kOk) << fault;
    const Cell broken = find(store, "broken", "raw_speed", 4);
    EXPECT_EQ(outcome_text(broken.outcome), outcome_text(outcome)) << fault << ": " << broken.reason;
    EXPECT_THAT(broken.values, IsEmpty());
    EXPECT_EQ(find(store, "sound", "raw_speed", 4).outcome, Outcome::kOk) << fault;
  }
}

// ---- what comes from outside, and what is left behind -------------------------------------------------------------------

pid_t start_run(const Campaign& campaign, const RunOptions& options, const std::string& mark);
std::vector<pid_t> workers_of(pid_t run);
Campaign real_campaign(const std::string& measures = R"("raw_speed", "consistency", "truth", "drift")");

void write_mark(const std::string& path, size_t size) { std::ofstream(path) << std::string(size, 'k'); }

// Where faults that other processes see leave their mark.
std::string mark_here(const std::string& path) {
  ::setenv("ASSAY_MISHAP_MARK", path.c_str(), 1);
  ::setenv("ASSAY_SANDBOX", "off", 1);  // a worker may not write there
  return path;
}

// An engine cannot reach what is not its own: the attempt is the outcome, with the system's reason.
TEST_F(RunsTest, WorkersAreConfined) {
  const Sandbox sandbox = offered_sandbox();
  if (sandbox.landlock == 0 || !sandbox.filter) GTEST_SKIP() << sandbox.lacking;
  const std::string home = dir("home"), mark = dir("mark");
  fs::create_directories(home);
  write_mark(mark, 3);
  ::setenv("HOME", home.c_str(), 1);
  ::setenv("XDG_CACHE_HOME", dir("cache").c_str(), 1);  // the coordinator keeps declarations of adapters there
  ::setenv("ASSAY_MISHAP_MARK", mark.c_str(), 1);
  std::vector<std::string> faults = {"write-home",  "read-file",    "append-file", "remove-file",  "open-socket",
                                     "change-mode", "limit-others", "slow-others", "share-memory", "type-commands"};
  if (sandbox.landlock >= 6) faults.emplace_back("signal-others");
  for (const std::string& fault : faults) {
    const std::string out = dir("out-" + fault);
    run_scored(faulty_campaign(fault, ", at_step = 3", R"("drift", "raw_speed")"), out);
    const Store store = Store::open(out);
    const Cell cell = find(store, "broken", "drift", 4);
    EXPECT_EQ(cell.outcome, Outcome::kDiverged) << fault;
    EXPECT_THAT(cell.reason,
                AllOf(HasSubstr(fault), AnyOf(HasSubstr("Permission denied"), HasSubstr("Operation not permitted"))));
    for (const char* measure : {"drift", "raw_speed"}) {
      EXPECT_EQ(find(store, "sound", measure, 4).outcome, Outcome::kOk) << fault << " " << measure;
    }
  }
  EXPECT_TRUE(fs::is_empty(home));
  EXPECT_EQ(fs::file_size(mark), 3U);
  // what a host of another language needs
  run_scored(faulty_campaign("write-scratch", ", at_step = 3", R"("drift")"), dir("scratch"));
  EXPECT_EQ(find(Store::open(dir("scratch")), "broken", "drift", 4).outcome, Outcome::kOk);
  reliability(
      "an engine writes to the home folder, reads, changes or removes another file, makes a socket, changes "
      "permissions, signals, limits or slows another process, shares memory with it, types on the terminal",
      static_cast<int>(faults.size()), "refused by the kernel: diverged, with the system's reason", "that cell");
}

// SIGKILL, as the kernel sends it when memory runs out: the cell is measured by another worker.
TEST_F(RunsTest, AKilledWorkerIsReplaced) {
  for (const char* measures : {R"("drift")", R"("consistency", "drift")", R"("raw_speed")"}) {
    const std::string out = dir(fmt::format("out{}", std::string_view(measures).size()));
    const std::string mark = mark_here(out + ".mark");
    const Campaign campaign = faulty_campaign("killed", ", times = 2, at_step = 3", measures);
    const RunSummary summary = run_scored(campaign, out);
    EXPECT_EQ(fs::file_size(mark), 2U) << "workers were killed";
    EXPECT_EQ(summary.unmeasured, 0);
    for (const Cell& cell : Store::open(out).cells()) {
      EXPECT_EQ(cell.outcome, Outcome::kOk) << cell.contender << " " << cell.measure << ": " << cell.reason;
    }
  }
  reliability("SIGKILL of a worker (as the out-of-memory killer sends it)", 6, "another worker measures the cell",
              "the time of that worker");
}

// Killed each time: nothing is said of the contender, and the next start tries again.
TEST_F(RunsTest, AWorkerThatIsAlwaysKilledIsNotMeasuredAndNotBlamed) {
  mark_here(dir("mark"));
  const Campaign campaign = faulty_campaign("killed", ", times = 1000, at_step = 3", R"("consistency", "raw_speed")");
  const RunSummary summary = run_scored(campaign, dir());
  EXPECT_EQ(summary.unmeasured, 5) << "reference, two of consistency, two of raw_speed";
  {
    const Store store = Store::open(dir());
    for (const Cell& cell : store.cells()) EXPECT_NE(cell.contender, "broken") << cell.measure;
    EXPECT_EQ(find(store, "sound", "consistency", 4).outcome, Outcome::kOk);
  }
  write_mark(dir("mark"), 1000);  // the memory is there again
  const RunSummary again = run_campaign(campaign, options(dir()));
  EXPECT_EQ(again.unmeasured, 0);
  for (const Cell& cell : Store::open(dir()).cells()) EXPECT_EQ(cell.outcome, Outcome::kOk) << cell.reason;
  reliability("SIGKILL of every worker of a contender", 9, "not measured, exit status 1; the next start measures it",
              "nothing");
}

// `set`: of the contender that is broken.
Campaign broken_batch(const std::string& set) {
  return parse_campaign(
      "name = \"worlds\"\ntimesteps_ms = [1]\n[timing]\nrounds = 3\nbatch_ms = 1\n"
      "[[contender]]\nname = \"sound\"\nbase = \"mishap\"\n"
      "[[contender]]\nname = \"broken\"\nbase = \"mishap\"\nset = {" +
          set + "}\n[[system]]\nname = \"planar-chain\"\nmeasures = [\"batch\"]\nworlds = [2]\nduration_s = 0.256\n",
      "worlds.toml");
}

Campaign killed_batch(int times) {
  return broken_batch("fault = \"killed\", at_step = 3, times = " + std::to_string(times));
}

// The states of worlds are examined as those of one run are.
TEST_F(RunsTest, WorldsWhoseStatesCannotBeHaveNoRate) {
  const std::vector<Fault> faults = {{"backward", Outcome::kCrashed, "was asked for"},
                                     {"wrong-size", Outcome::kCrashed, "the engine gave a state of another size"},
                                     {"zero-orientation", Outcome::kDiverged, "an orientation of length 0"},
                                     {"nan-time", Outcome::kDiverged, "a non-finite number"}};
  for (const Fault& fault : faults) {
    run_scored(broken_batch("fault = \"" + fault.name + "\""), dir(fault.name));
    const Store store = Store::open(dir(fault.name));
    const Cell broken = find(store, "broken", "batch-2", 1);
    EXPECT_EQ(outcome_text(broken.outcome), outcome_text(fault.outcome)) << fault.name << ": " << broken.reason;
    EXPECT_THAT(broken.reason, HasSubstr(fault.reason));
    EXPECT_FALSE(value(broken, "batch_rate")) << fault.name;
    EXPECT_EQ(find(store, "sound", "batch-2", 1).outcome, Outcome::kOk);
  }
}

// What is killed is not the worker but one of the processes in which it steps worlds.
TEST_F(RunsTest, AKilledProcessOfABatchIsNotBlamed) {
  const std::string mark = mark_here(dir("mark"));
  const RunSummary summary = run_scored(killed_batch(2), dir("twice"));
  EXPECT_EQ(fs::file_size(mark), 2U) << "processes were killed";
  EXPECT_EQ(summary.unmeasured, 0);
  for (const Cell& cell : Store::open(dir("twice")).cells()) {
    EXPECT_EQ(cell.outcome, Outcome::kOk) << cell.contender << ": " << cell.reason;
  }
  const Campaign always = killed_batch(1000);
  EXPECT_EQ(run_scored(always, dir("always")).unmeasured, 1);
  for (const Cell& cell : Store::open(dir("always")).cells()) EXPECT_EQ(cell.contender, "sound") << cell.reason;
  write_mark(mark, 1000);  // the memory is there again
  EXPECT_EQ(run_campaign(always, options(dir("always"))).unmeasured, 0);
  for (const Cell& cell : Store::open(dir("always")).cells()) EXPECT_EQ(cell.outcome, Outcome::kOk) << cell.reason;
  reliability("SIGKILL of a process in which worlds of a batch are stepped", 5,
              "another worker measures the cell; after the third it is not measured, exit status 1", "nothing");
}

// An engine that needs another process: the adapter says how that ended.
TEST_F(RunsTest, AKilledNodeIsNotHavoksFailure) {
  try {
    const ResolvedContender node = Registry::instance().resolve("havok-node");
    const Model model = faulty_campaign("none").systems.front().model;
    node.engine->create(model, model.initial, node.settings);
  } catch (const InputError& error) {
    GTEST_SKIP() << error.what();
  } catch (const EngineError& error) {
    GTEST_SKIP() << error.what();
  }
  const Campaign campaign = parse_campaign(
      "name = \"node\"\ncontenders = [\"havok-node\"]\ntimesteps_ms = [1]\nmeasures = [\"drift\"]\n"
      "[[system]]\nname = \"planar-chain\"\nduration_s = 0.128\n",
      "node.toml");
  pass_gate(campaign, dir());
  const pid_t run = start_run(campaign, options(dir()), dir());
  bool killed = false;
  for (int i = 0; i < 10000 && !killed; ++i) {
    for (const pid_t worker : workers_of(run)) {
      for (const pid_t child : children_of(worker)) killed = killed || ::kill(child, SIGKILL) == 0;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  int status = 0;
  ::waitpid(run, &status, 0);
  EXPECT_TRUE(killed);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  const Store store = Store::open(dir());
  EXPECT_EQ(find(store, "havok-node", "drift", 1).outcome, Outcome::kOk);
  reliability("SIGKILL of the Node in which Havok runs", 1, "another worker goes on", "the time of that worker");
}

TEST_F(RunsTest, AKilledConformanceSuiteIsNotBlamedEither) {
  mark_here(dir("mark"));
  const Campaign campaign = faulty_campaign("killed", ", times = 1, at_step = 3");
  run_campaign(campaign, options(dir()));
  const std::vector<ConformanceRow> rows = Store::open(dir()).conformance();
  EXPECT_FALSE(rows.empty());
  for (const ConformanceRow& row : rows) EXPECT_EQ(row.note.find("signal 9"), std::string::npos) << row.test;
  // The same verdicts as of an equal contender whose worker nobody killed.
  std::map<std::string, std::string> verdicts;
  for (const ConformanceRow& row : rows) {
    const auto [found, fresh] = verdicts.emplace(row.test, row.status);
    if (!fresh) {
      EXPECT_EQ(found->second, row.status) << row.test;
    }
  }
  reliability("SIGKILL of a worker within the conformance suite", 1, "the suite goes on from that test",
              "the time of that test");
}

TEST_F(RunsTest, FailedCellsAreMeasuredAgainOnRequest) {
  const Campaign campaign = faulty_campaign("none", "", R"("consistency", "drift")");
  run_scored(campaign, dir());
  const std::string whole = table(dir());
  {
    Store store = Store::create(dir(), {campaign.name, campaign.hash()});
    for (Cell cell : store.cells()) {
      if (cell.contender != "broken") continue;
      cell.outcome = cell.timestep_ms == 4 ? Outcome::kTimeout : Outcome::kCrashed;
      cell.reason = "signal 9 (Killed)";
      cell.values.clear();
      store.put_cell(cell);
    }
  }
  EXPECT_NE(table(dir()), whole);
  EXPECT_EQ(run_campaign(campaign, options(dir())).done_now, 0) << "what is stored stays";
  RunOptions retry = options(dir());
  retry.retry = true;
  EXPECT_EQ(run_campaign(campaign, retry).done_now, 5);
  EXPECT_EQ(table(dir()), whole);
  EXPECT_EQ(run_campaign(campaign, retry).done_now, 0) << "nothing is left to try again";
}

TEST_F(RunsTest, WhatAnEngineStartsEndsWithItsWorker) {
  const std::string mark = mark_here(dir("mark"));
  run_scored(faulty_campaign("leave"), dir());
  std::ifstream file(mark);
  int left = 0;
  for (pid_t process = 0; file >> process; ++left) {
    bool gone = false;
    for (int i = 0; i < 500 && !gone; ++i) {
      gone = ::kill(process, 0) != 0;
      if (!gone) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(gone) << "process " << process << " outlives its worker";
  }
  EXPECT_GE(left, 2) << "one for each timestep, and of the look at the speed";
  reliability("an engine starts a process that leaves its group and session", 2, "it ends with the worker", "nothing");
}

TEST_F(RunsTest, WhatAnEngineStartsEndsWithAKilledParent) {
  const std::string mark = mark_here(dir("mark"));
  const Campaign campaign = faulty_campaign("leave", ", at_step = 1");
  pass_gate(campaign, dir());
  const pid_t run = start_run(campaign, options(dir()), dir());
  pid_t left = 0;
  for (int i = 0; i < 1000 && left == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::ifstream(mark) >> left;
  }
  ::kill(run, SIGKILL);
  ::waitpid(run, nullptr, 0);
  ASSERT_GT(left, 0);
  bool gone = false;
  for (int i = 0; i < 500 && !gone; ++i) {
    gone = ::kill(left, 0) != 0;
    if (!gone) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(gone) << "process " << left << " outlives the killed run";
  reliability("SIGKILL of the parent while an engine has a process of its own", 1, "it ends with the worker",
              "nothing");
}

// The guard itself is killed: its parent does what it would have done.
TEST_F(RunsTest, WhatAnEngineStartsEndsWithAKilledGuard) {
  const std::string mark = mark_here(dir("mark")), scratch = dir("scratch");
  fs::create_directories(scratch);
  const char* const temporary = std::getenv("TMPDIR");
  const std::string before = temporary == nullptr ? "" : temporary;
  ::setenv("TMPDIR", scratch.c_str(), 1);
  const Campaign campaign = faulty_campaign("leave-and-hang");
  pass_gate(campaign, dir());
  RunOptions without_probe = options(dir());
  without_probe.probe = false;
  const pid_t run = start_run(campaign, without_probe, dir());
  before.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", before.c_str(), 1);
  const auto left = [&] {
    std::vector<pid_t> found;
    std::ifstream file(mark);
    for (pid_t process = 0; file >> process;) found.push_back(process);
    return found;
  };
  for (int i = 0; i < 2000 && left().empty(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  int kills = 0;
  for (const pid_t guard : children_of(run)) kills += ::kill(guard, SIGKILL) == 0 ? 1 : 0;
  int status = 0;
  ::waitpid(run, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_GT(kills, 0);
  EXPECT_GT(left().size(), 2U) << "a killed guard's job is tried again";
  for (const pid_t process : left()) EXPECT_NE(::kill(process, 0), 0) << "process " << process << " outlives its guard";
  EXPECT_TRUE(fs::is_empty(scratch)) << fs::directory_iterator(scratch)->path();
  const Store store = Store::open(dir());
  for (const double timestep : {1.0, 4.0}) {
    EXPECT_EQ(find(store, "sound", "drift", timestep).outcome, Outcome::kOk);
    EXPECT_EQ(find(store, "broken", "drift", timestep).outcome, Outcome::kTimeout);
  }
  reliability("SIGKILL of the guard above a worker whose engine has a process of its own", kills,
              "that ends too, another worker measures the cell", "the time of that worker");
}

#ifndef __SANITIZE_ADDRESS__  // memory has no limit there
TEST_F(RunsTest, AnEngineThatTakesAllMemoryFailsAlone) {
  run_scored(faulty_campaign("hoard"), dir());
  const Store store = Store::open(dir());
  const Cell broken = find(store, "broken", "drift", 4);
  EXPECT_EQ(outcome_text(broken.outcome), "crashed") << broken.reason;
  EXPECT_THAT(broken.reason, HasSubstr("out of memory"));
  EXPECT_EQ(find(store, "sound", "drift", 4).outcome, Outcome::kOk);
  reliability("an engine takes all memory", 2, "crashed: out of memory, at 1 to 4 GiB a worker", "that cell");
}
#endif

// Kept runs that were damaged or swapped since: all are found at one start, and are made again.
TEST_F(RunsTest, DamagedRunsAreAllMadeAgainAtOneStart) {
  const Campaign campaign = real_campaign(R"("consistency", "drift")");
  run_scored(campaign, dir("whole"));
  const std::string whole = table(dir("whole"));
  // as if only the references had been reached
  pass_gate(campaign, dir());
  fs::copy(dir("whole") + "/trajectories", dir() + "/trajectories", fs::copy_options::recursive);
  {
    const Store store = Store::open(dir("whole"));
    Store copy = Store::create(dir(), {campaign.name, campaign.hash()});
    for (const Cell& cell : store.cells()) {
      if (cell.measure == "reference") copy.put_cell(cell, store.samples(cell.id));
    }
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(dir() + "/trajectories")) files.push_back(entry.path());
  ASSERT_GE(files.size(), 3U);
  const fs::path aside = dir("aside");
  fs::rename(files[0], aside);
  fs::rename(files[1], files[0]);
  fs::rename(aside, files[1]);
  fs::resize_file(files[2], 100);
  const RunSummary summary = run_campaign(campaign, options(dir()));
  EXPECT_FALSE(summary.interrupted);
  EXPECT_EQ(table(dir()), whole);
  reliability("kept runs are swapped and cut off between two starts", 3, "made again at one start, same values",
              "the time of these runs");
}

// ---- the conformance suite -----------------------------------------------------------------------------------------------------------

TEST_F(RunsTest, AContenderThatFailsTheConformanceSuiteIsNotScored) {
  const Campaign campaign = parse_campaign(
      "name = \"gate\"\ncontenders = [\"null\", \"mujoco-euler\"]\ntimesteps_ms = [1, 4]\nmeasures = [\"drift\"]\n"
      "[[system]]\nname = \"planar-chain\"\nduration_s = 0.128\n",
      "gate.toml");
  const RunSummary summary = run_campaign(campaign, options(dir()));
  EXPECT_THAT(summary.failed_gate, SizeIs(1));
  EXPECT_THAT(summary.failed_gate, Contains(AllOf(testing::Field(&Missing::name, "null"),
                                                  testing::Field(&Missing::why, HasSubstr("free-fall")))));
  const Store store = Store::open(dir());
  const Cell unscored = find(store, "null", "drift", 4);
  EXPECT_EQ(unscored.outcome, Outcome::kUnsupported);
  EXPECT_THAT(unscored.reason, AllOf(HasSubstr("failed the conformance suite"), HasSubstr("free-fall")));
  EXPECT_EQ(find(store, "mujoco-euler", "drift", 4).outcome, Outcome::kOk);
  int tests = 0;
  for (const ConformanceRow& row : store.conformance()) {
    if (row.contender != "mujoco-euler") continue;
    ++tests;
    EXPECT_NE(row.status, "fail") << row.test << ": " << row.note;
  }
  EXPECT_GT(tests, 10);
}

TEST_F(RunsTest, AContenderThatCrashesInTheConformanceSuiteFailsOnlyThoseTests) {
  const Campaign campaign = parse_campaign(
      "name = \"gate\"\ntimesteps_ms = [1]\nmeasures = [\"drift\"]\n[[contender]]\nname = \"broken\"\nbase = "
      "\"mishap\"\n"
      "set = {fault = \"crash\"}\n[[system]]\nname = \"planar-chain\"\nduration_s = 0.128\n",
      "gate.toml");
  run_campaign(campaign, options(dir()));
  const Store store = Store::open(dir());
  int crashed = 0;
  const std::vector<ConformanceRow> rows = store.conformance();
  for (const ConformanceRow& row : rows) {
    if (row.note.find("signal 11") == std::string::npos) continue;
    EXPECT_EQ(row.status, "fail");
    ++crashed;
  }
  EXPECT_GT(crashed, 3);
  EXPECT_GT(rows.size(), static_cast<size_t>(crashed)) << "tests without as many steps ended";
  EXPECT_EQ(find(store, "broken", "drift", 1).outcome, Outcome::kUnsupported);
}

#ifndef __SANITIZE_ADDRESS__  // whose workers have no limit
TEST_F(RunsTest, ASuiteGoesOnInAnotherWorkerBeforeTheMemoryOfOneRunsOut) {
  run_campaign(faulty_campaign("keep"), options(dir()));
  const Store store = Store::open(dir());
  std::map<std::string, std::vector<std::string>> tests;
  for (const ConformanceRow& row : store.conformance()) {
    tests[row.contender].push_back(row.test);
    EXPECT_EQ(row.note.find("memory"), std::string::npos) << row.contender << ": " << row.test << ": " << row.note;
    EXPECT_EQ(row.note.find("alloc"), std::string::npos) << row.contender << ": " << row.test << ": " << row.note;
  }
  EXPECT_EQ(tests["broken"], tests["sound"]);
  EXPECT_THAT(tests["broken"], SizeIs(conformance_tests().size()));
}
#endif

// ---- values ---------------------------------------------------------------------------------------------------------------

Campaign real_campaign(const std::string& measures) {
  return parse_campaign("name = \"real\"\ntimesteps_ms = [\"1/4\", 1, 4]\nreference_ms = \"1/8\"\nmeasures = [" +
                            measures +
                            "]\n[timing]\nrounds = 3\nbatch_ms = 2\n"
                            "[[contender]]\nname = \"first\"\nbase = \"mujoco-euler\"\n"
                            "[[contender]]\nname = \"second\"\nbase = \"mujoco-euler\"\n"
                            "[[contender]]\nname = \"cartesian\"\nbase = \"ode-step\"\n"
                            "[[contender]]\nname = \"fourth-order\"\nbase = \"mujoco-rk4\"\n"
                            "[[ratio]]\nof = \"fourth-order\"\nto = \"first\"\n"
                            "[[system]]\nname = \"planar-chain\"\nduration_s = 0.256\npieces = 3\npiece_ms = 64\n",
                        "real.toml");
}

TEST_F(RunsTest, ValuesAreWhatTheyClaim) {
  const RunSummary summary = run_scored(real_campaign(), dir());
  const Store store = Store::open(dir());
  for (const auto& [outcome, count] : summary.outcomes) EXPECT_EQ(outcome, "ok") << count;

  // One contender under two names has the same values to the bit.
  for (const double timestep : {0.125, 0.25, 1.0, 4.0}) {
    EXPECT_EQ(value(find(store, "first", "consistency", timestep), "consistency"),
              value(find(store, "second", "consistency", timestep), "consistency"));
    EXPECT_EQ(value(find(store, "first", "truth", timestep), "truth_error"),
              value(find(store, "second", "truth", timestep), "truth_error"));
  }
  // The restart floor lies under the errors, and errors grow with the timestep.
  const double floor = value(find(store, "first", "consistency", 0.125), "restart_floor").value_or(-1);
  EXPECT_GE(floor, 0);
  EXPECT_LT(floor, 1e-9);
  for (const char* contender : {"first", "cartesian"}) {
    EXPECT_LT(number(find(store, contender, "consistency", 1), "consistency"),
              number(find(store, contender, "consistency", 4), "consistency"));
  }
  // Over the whole run the error is at least that at its end.
  for (const char* contender : {"first", "cartesian", "fourth-order"}) {
    const Cell truth = find(store, contender, "truth", 4);
    EXPECT_GE(number(truth, "truth_error_max"), number(truth, "truth_error")) << contender;
    EXPECT_GE(number(truth, "truth_error_max"), number(truth, "truth_error_rms")) << contender;
    EXPECT_GT(number(truth, "truth_error_rms"), 0) << contender;
    EXPECT_TRUE(value(find(store, contender, "drift", 4), "energy_drift_rate")) << contender;
  }
  // Orders of convergence: between this timestep and the next smaller one.
  EXPECT_NEAR(number(find(store, "first", "truth", 4), "truth_order"), 1, 0.1);
  EXPECT_NEAR(number(find(store, "fourth-order", "truth", 4), "truth_order"), 4, 0.3);
  EXPECT_FALSE(value(find(store, "first", "truth", 0.125), "truth_order")) << "the smallest has no smaller one";
  EXPECT_LT(number(find(store, "fourth-order", "drift", 4), "energy_drift_relative"), 1e-6);

  // Speed in three units, with its interval and its samples.
  const Cell timed = find(store, "cartesian", "raw_speed", 1);
  const double step_us = number(timed, "step_time");
  EXPECT_GT(step_us, 0);
  EXPECT_NEAR(number(timed, "raw_speed") * step_us, 1000, 1e-6);
  EXPECT_NEAR(number(timed, "realtime_factor") * step_us, 1000, 1e-6) << "1 ms";
  for (const Value& each : timed.values) {
    if (!each.low) continue;
    EXPECT_LE(each.low, each.value) << each.name;
    EXPECT_GE(each.high, each.value) << each.name;
  }
  const std::vector<SampleSeries> samples = store.samples(timed.id);
  const auto rounds = timed_rounds(samples);
  ASSERT_TRUE(rounds);
  EXPECT_THAT(rounds->rounds, SizeIs(3));
  EXPECT_NEAR(step_time(*rounds).value, step_us, 1e-9) << "it follows from the stored samples";
  for (const char* contender : {"first", "second", "fourth-order"}) {
    const auto others = timed_rounds(store.samples(find(store, contender, "raw_speed", 1).id));
    ASSERT_TRUE(others);
    EXPECT_EQ(others->weights, rounds->weights) << contender << ": the same windows";
    EXPECT_EQ(number(find(store, contender, "raw_speed", 1), "coverage"), number(timed, "coverage"));
  }
  EXPECT_GT(number(timed, "coverage"), 0);
  EXPECT_LE(number(timed, "step_p50"), number(timed, "step_p99"));
  EXPECT_LE(number(timed, "step_p99"), number(timed, "step_worst"));
  EXPECT_GE(number(timed, "disturbed_rounds"), 0);
  EXPECT_GE(number(timed, "repeated_rounds"), number(timed, "disturbed_rounds") > 0 ? 1 : 0);
  EXPECT_EQ(number(timed, "input_time"), 0) << "a passive chain without springs has no inputs";
  EXPECT_LT(number(timed, "clock_share"), 0.005);
  EXPECT_GT(timed.engine_s, 0);
  EXPECT_GE(timed.wall_s, timed.engine_s);

  // The same under two names, and only that.
  EXPECT_THAT(summary.aa, SizeIs(4)) << "one pair at four timesteps";
  for (const TimePair& pair : summary.aa) {
    EXPECT_EQ(pair.a, "first");
    EXPECT_EQ(pair.b, "second");
    EXPECT_LE(pair.low, pair.ratio);
    EXPECT_GE(pair.high, pair.ratio);
  }
  // The one that was asked for: four evaluations a step take longer than one, in the mean over the timesteps; three
  // rounds of a millisecond can be disturbed at any of them.
  EXPECT_THAT(summary.ratios, SizeIs(4));
  double product = 1;
  for (const TimePair& pair : summary.ratios) {
    EXPECT_EQ(pair.a, "first");
    EXPECT_EQ(pair.b, "fourth-order");
    EXPECT_LE(pair.low, pair.ratio);
    EXPECT_GE(pair.high, pair.ratio);
    product *= pair.ratio;
  }
  EXPECT_GT(product, 1);
  // The engine that does nothing was measured with the others.
  const double harness_us = number(find(store, "null", "raw_speed", 1), "step_time");
  EXPECT_GT(harness_us, 0);
  EXPECT_LT(harness_us, 0.1 * step_us);
}

// An engine that waits within its step has little of the processor's time, as one that others disturb.
TEST_F(RunsTest, DisturbedTurnsAreRepeatedAndCounted) {
  const Campaign campaign = parse_campaign(
      "name = \"disturbed\"\ntimesteps_ms = [4]\nreference_ms = 4\nmeasures = [\"raw_speed\"]\n"
      "[timing]\nrounds = 6\nprocesses = 2\nbatch_ms = 20\n"
      "[[contender]]\nname = \"waits\"\nbase = \"mishap\"\nset = {fault = \"slow\"}\n"
      "[[system]]\nname = \"planar-chain\"\nduration_s = 0.128\n",
      "disturbed.toml");
  run_scored(campaign, dir());
  const Store store = Store::open(dir());
  const Cell timed = find(store, "waits", "raw_speed", 4);
  EXPECT_EQ(number(timed, "disturbed_rounds"), 6) << "repeating does not help";
  EXPECT_EQ(number(timed, "repeated_rounds"), 3) << "half of the rounds";
  EXPECT_GT(number(timed, "step_time"), 4900) << "they count all the same";
  for (const SampleSeries& series : store.samples(timed.id)) {
    if (series.name == "cpu_share") {
      EXPECT_THAT(series.values, testing::Each(testing::Lt(0.5)));
    }
  }
}

// Windows of a part of the run begin in states of the run that is timed, not of a finer one.
TEST_F(RunsTest, WindowsStartFromTheRunAtTheTimedTimestep) {
  const Campaign campaign = parse_campaign(
      "name = \"starts\"\ncontenders = [\"mujoco-euler\"]\ntimesteps_ms = [\"1/4\", 4]\nreference_ms = \"1/4\"\n"
      "measures = [\"raw_speed\"]\n[timing]\nrounds = 4\nprocesses = 2\nbatch_ms = 0.05\nwindows = 8\n"
      "[[system]]\nname = \"planar-chain\"\nduration_s = 1.024\nsample_ms = 32\n",
      "starts.toml");
  run_scored(campaign, dir());
  const Store store = Store::open(dir());
  const Model& model = campaign.systems.front().model;
  int own_runs = 0;
  for (const PlannedCell& cell : make_plan(campaign).cells) {
    if (cell.measure != "raw_speed") continue;
    const Cell timed = find(store, "mujoco-euler", "raw_speed", cell.timestep_ms);
    EXPECT_EQ(timed.outcome, Outcome::kOk) << timed.reason;
    EXPECT_LT(number(timed, "window_share"), 1) << "there would be nothing to start from";
    EXPECT_EQ(cell.timed_run.empty(), cell.timestep_ms == 0.25) << "the reference run is that of its own timestep";
    if (cell.timed_run.empty()) continue;
    const auto kept = read_trajectory(store.trajectories_dir(), cell.timed_run);
    if (!kept) {
      ADD_FAILURE() << "no run at " << cell.timestep_ms << " ms";
      continue;
    }
    ++own_runs;
    ResolvedContender contender = campaign.contenders.front().resolved;
    contender.settings.timestep = 1e-3 * cell.timestep_ms;
    Model passive = model;
    passive.actuators.clear();
    const auto simulation = contender.engine->create(passive, model.initial, contender.settings);
    State state;
    for (const State& each : kept->states) {
      simulation->read_state(state);
      EXPECT_EQ(state.time, each.time);
      EXPECT_EQ(state.bodies.back().p_WBcm, each.bodies.back().p_WBcm) << each.time;
      simulation->advance(8);
    }
    EXPECT_THAT(kept->states, SizeIs(32)) << "all that a window may start from";
  }
  EXPECT_EQ(own_runs, 1);
}

TEST_F(RunsTest, CommonStatesAreThoseOfOneContender) {
  const Campaign campaign = parse_campaign(
      "name = \"common\"\ncontenders = [\"mujoco-euler\", \"ode-quick\"]\ntimesteps_ms = [1]\nreference_ms = 1\n"
      "measures = [\"raw_speed\"]\n[timing]\nrounds = 2\nprocesses = 2\nbatch_ms = 5\nwindows = 4\n"
      "states = \"common\"\n[[system]]\nname = \"planar-chain\"\nduration_s = 0.128\nsample_ms = 4\n",
      "common.toml");
  run_scored(campaign, dir());
  const Store store = Store::open(dir());
  for (const char* contender : {"mujoco-euler", "ode-quick"}) {
    const Cell timed = find(store, contender, "raw_speed", 1);
    EXPECT_EQ(timed.outcome, Outcome::kOk) << timed.reason;
    EXPECT_GT(number(timed, "coverage"), 0);
  }
}

TEST_F(RunsTest, DerivedValuesFlagAnErrorThatDoesNotDependOnTheTimestep) {
  Store store = Store::create(dir(), {"c", "h"});
  double timestep = 1.0 / 64;
  for (const double error : {0.29, 0.29, 0.291, 0.3}) {
    for (const char* contender : {"floored", "sound"}) {
      Cell cell;
      cell.key = contender + std::to_string(timestep);
      cell.system = "chain";
      cell.contender = contender;
      cell.timestep_ms = timestep;
      cell.measure = "truth";
      const double e = contender == std::string("sound") ? 1e-3 * timestep : error;
      cell.values = {{"truth_error", "m", e, {}, {}}, {"truth_rounding", "m", 1e-12, {}, {}}};
      store.put_cell(cell);
    }
    timestep *= 2;
  }
  const std::vector<std::string> warnings = derive_values(store);
  EXPECT_THAT(warnings, SizeIs(1));
  EXPECT_THAT(warnings, Contains(AllOf(HasSubstr("floored"), HasSubstr("0.29 m"))));
  EXPECT_EQ(value(find(store, "floored", "truth", 1.0 / 64), "truth_floor"), 0.29);
  EXPECT_FALSE(value(find(store, "sound", "truth", 1.0 / 64), "truth_floor"));
  EXPECT_NEAR(number(find(store, "sound", "truth", 1.0 / 8), "truth_order"), 1, 1e-9);
  EXPECT_EQ(derive_values(store), warnings) << "once more changes nothing";
}

TEST_F(RunsTest, DerivedValuesMarkErrorsNearTheRestartFloor) {
  Store store = Store::create(dir(), {"c", "h"});
  for (const auto& [timestep, error] : {std::pair{0.1, 1e-5}, std::pair{0.2, 2e-5}, std::pair{0.4, 1e-3}}) {
    Cell cell;
    cell.key = std::to_string(timestep);
    cell.system = "chain";
    cell.contender = "c";
    cell.timestep_ms = timestep;
    cell.measure = "consistency";
    cell.values = {{"consistency", "m", error, {}, {}}};
    if (timestep == 0.1) cell.values.push_back({"restart_floor", "m", error, {}, {}});
    store.put_cell(cell);
  }
  derive_values(store);
  EXPECT_FALSE(value(find(store, "c", "consistency", 0.1), "consistency_floor"));
  EXPECT_EQ(value(find(store, "c", "consistency", 0.2), "consistency_floor"), 1e-5);
  const std::optional<double> bound = value(find(store, "c", "consistency", 0.2), "consistency_bound");
  ASSERT_TRUE(bound);
  EXPECT_DOUBLE_EQ(bound.value_or(0), 3e-5) << "the distance and the floor";
  EXPECT_FALSE(value(find(store, "c", "consistency", 0.4), "consistency_floor"));
  EXPECT_FALSE(value(find(store, "c", "consistency", 0.4), "consistency_bound"));
}

// A restart that is exact hides that the fine-step run itself is rounded: the curve stops falling.
TEST_F(RunsTest, DerivedValuesMarkErrorsOnAPlateau) {
  Store store = Store::create(dir(), {"c", "h"});
  double timestep = 1.0 / 64;
  for (const double error : {0.0, 2.4e-4, 2.6e-4, 2.5e-4, 2.6e-4, 9e-4}) {
    Cell cell;
    cell.key = std::to_string(timestep);
    cell.system = "chain";
    cell.contender = "c";
    cell.timestep_ms = timestep;
    cell.measure = "consistency";
    cell.values = {{"consistency", "m", error, error, 1.5 * error}};
    if (error == 0) cell.values.push_back({"restart_floor", "m", error, {}, {}});
    store.put_cell(cell);
    timestep *= 2;
  }
  derive_values(store);
  EXPECT_FALSE(value(find(store, "c", "consistency", 1.0 / 64), "consistency_bound")) << "the reference itself";
  EXPECT_EQ(value(find(store, "c", "consistency", 1.0 / 8), "consistency_floor"), 2.6e-4);
  EXPECT_NEAR(value(find(store, "c", "consistency", 1.0 / 8), "consistency_bound").value_or(0), 6.35e-4, 1e-12);
  EXPECT_FALSE(value(find(store, "c", "consistency", 0.5), "consistency_bound")) << "beyond three floors";
}

TEST_F(RunsTest, ShardsTogetherAreTheWhole) {
  const Campaign campaign = real_campaign(R"("consistency", "truth")");
  run_scored(campaign, dir("whole"));
  pass_gate(campaign, dir("parts"));
  int cells = 0;
  for (int index = 1; index <= 3; ++index) {
    RunOptions part = options(dir("parts"));
    part.shard = {index, 3};
    cells += run_campaign(campaign, part).done_now;
  }
  EXPECT_EQ(static_cast<size_t>(cells), Store::open(dir("whole")).cells().size());
  EXPECT_EQ(table(dir("parts")), table(dir("whole")));
}

// ---- stopping and going on ------------------------------------------------------------------------------------------------

TEST_F(RunsTest, ASecondRunHasNothingToDo) {
  const Campaign campaign = real_campaign(R"("drift")");
  run_scored(campaign, dir());
  const RunSummary again = run_campaign(campaign, options(dir()));
  EXPECT_EQ(again.done_now, 0);
  EXPECT_EQ(again.done_before, again.cells);
}

TEST_F(RunsTest, ALostTrajectoryIsComputedAgain) {
  const Campaign campaign = real_campaign(R"("consistency")");
  run_scored(campaign, dir());
  const std::string whole = table(dir());
  fs::remove_all(dir() + "/trajectories");
  {
    // as if the last cells had not been reached yet
    Store store = Store::open(dir());
    std::vector<Cell> cells = store.cells();
    const std::string kept = dir("kept");
    Store copy = Store::create(kept, {campaign.name, campaign.hash()});
    copy.set_systems(store.systems());
    copy.set_contenders(store.contenders());
    for (const Cell& cell : cells) {
      if (cell.measure == "reference") copy.put_cell(cell, store.samples(cell.id));
    }
  }
  pass_gate(campaign, dir("kept"));
  run_campaign(campaign, options(dir("kept")));
  EXPECT_EQ(table(dir("kept")), whole);
}

// Runs the campaign in a process of its own and returns its id. It ends with status 0 when the campaign was done, with
// 10 when it was interrupted.
pid_t start_run(const Campaign& campaign, const RunOptions& options, const std::string& mark) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::setenv("ASSAY_TEST_MARK", mark.c_str(), 1);
  try {
    const RunSummary summary = run_campaign(campaign, options);
    ::_exit(summary.interrupted ? 10 : 0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    ::_exit(1);
  }
}

// Processes that were started by one with this mark in its environment.
int marked_processes(const std::string& mark) {
  int count = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc", error)) {
    std::ifstream file(entry.path() / "environ", std::ios::binary);
    std::stringstream environment;
    environment << file.rdbuf();
    // as its parent had it: what a process sets itself is not seen here
    if (environment.str().find("ASSAY_TEST_MARK=" + mark) != std::string::npos) ++count;
  }
  return count;
}

// Workers get SIGKILL when their parent dies, and are gone as soon as the kernel comes to it.
bool all_gone(const std::string& mark) {
  for (int i = 0; i < 500; ++i) {
    if (marked_processes(mark) == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

TEST_F(RunsTest, KilledAtRandomMomentsItEndsWithTheSameTable) {
  const Campaign campaign = real_campaign();
  run_scored(campaign, dir("whole"));
  const std::string out = dir("killed");
  const std::string& mark = out;
  pass_gate(campaign, out);
  std::random_device seed;
  const unsigned used_seed = seed();
  std::mt19937 random(used_seed);
  int kills = 0, status = -1;
  size_t cells = 0;
  for (int attempt = 0; attempt < 200 && status != 0; ++attempt) {
    const pid_t run = start_run(campaign, options(out), mark);
    // The later, the more time: it has to come to its end.
    const double wait_s = std::uniform_real_distribution<double>(0.02, 0.3 + 0.1 * attempt)(random);
    std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    ::kill(run, SIGKILL);
    ::waitpid(run, &status, 0);
    if (WIFSIGNALED(status)) ++kills;
    ASSERT_TRUE(all_gone(mark)) << "workers outlive their parent";
    const size_t now = Store::open(out).cells().size();
    ASSERT_GE(now, cells) << "a finished cell was lost; seed " << used_seed;
    cells = now;
  }
  EXPECT_EQ(status, 0);
  EXPECT_GT(kills, 0);
  EXPECT_EQ(table(out), table(dir("whole"))) << "seed " << used_seed;
  reliability("SIGKILL of the parent at random moments", kills, "the same command goes on; the same values",
              "running cells");
}

// The worker processes of a run, below their guards.
std::vector<pid_t> workers_of(pid_t run) {
  std::vector<pid_t> workers;
  for (const pid_t guard : children_of(run)) {
    for (const pid_t worker : children_of(guard)) workers.push_back(worker);
  }
  return workers;
}

// Without the timings of the harness, which are no cells of the campaign: one whose worker was lost three times is not
// measured again once its contenders are.
std::string without_harness(const std::string& table) {
  std::string kept;
  for (size_t begin = 0; begin < table.size();) {
    const size_t end = std::min(table.find('\n', begin), table.size() - 1) + 1;
    const std::string line = table.substr(begin, end - begin);
    if (line.find(" null raw_speed ") == std::string::npos) kept += line;
    begin = end;
  }
  return kept;
}

// Workers are killed, and their guards: the run does not even stop.
TEST_F(RunsTest, WorkersKilledAtRandomMomentsLeaveTheSameTable) {
  const Campaign campaign = real_campaign();
  run_scored(campaign, dir("whole"));
  pass_gate(campaign, dir());
  const unsigned used_seed = std::random_device{}();
  std::mt19937 random(used_seed);
  const pid_t run = start_run(campaign, options(dir()), dir());
  constexpr int kMostKills = 25;
  int kills = 0, status = 0;
  while (::waitpid(run, &status, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50 + random() % 150));
    const std::vector<pid_t> victims = random() % 3 == 0 ? children_of(run) : workers_of(run);
    if (victims.empty() || kills >= kMostKills) continue;
    // rarely enough that no job is lost three times
    if (::kill(victims[random() % victims.size()], random() % 4 == 0 ? SIGTERM : SIGKILL) == 0) ++kills;
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_GT(kills, 0);
  int starts = 0;
  while (run_campaign(campaign, options(dir())).unmeasured > 0 && starts < 3) ++starts;
  EXPECT_EQ(without_harness(table(dir())), without_harness(table(dir("whole")))) << "seed " << used_seed;
  reliability("SIGKILL and SIGTERM of workers at random moments", kills, "measured by other workers; the same values",
              "the time of these workers");
}

TEST_F(RunsTest, AnInterruptStopsPolitely) {
  const Campaign campaign = real_campaign();
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string out = dir("signal" + std::to_string(signal));
    pass_gate(campaign, out);
    const pid_t run = start_run(campaign, options(out), out);
    for (int i = 0; i < 1000 && Store::open(out).cells().empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ::kill(run, signal);
    int status = 0;
    ::waitpid(run, &status, 0);
    ASSERT_TRUE(WIFEXITED(status)) << "it stored what it had and ended by itself";
    EXPECT_EQ(WEXITSTATUS(status), 10);
    EXPECT_TRUE(all_gone(out));
    const size_t cells = Store::open(out).cells().size();
    EXPECT_GT(cells, 0U);
    EXPECT_LT(cells, make_plan(campaign).cells.size());
    const RunSummary rest = run_campaign(campaign, options(out));
    EXPECT_FALSE(rest.interrupted) << "the signal is forgotten";
    EXPECT_EQ(rest.done_before + rest.done_now, rest.cells);
  }
  reliability("SIGINT and SIGTERM of the parent", 2, "stops within moments, the same command goes on", "running cells");
}

TEST_F(RunsTest, AFullDiskIsAnErrorThatLosesNothing) {
  const Campaign campaign = real_campaign(R"("consistency", "drift")");
  run_scored(campaign, dir("whole"));
  pass_gate(campaign, dir());
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit = {110'000, 110'000};  // bytes of one file
    ::setrlimit(RLIMIT_FSIZE, &limit);
    std::string text = "(nothing was thrown)";
    try {
      run_campaign(campaign, options(dir()));
    } catch (const SystemError& error) {
      text = error.what();
    }
    [[maybe_unused]] const ssize_t written = ::write(ends[1], text.data(), text.size());
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  std::string text(1000, '\0');
  text.resize(static_cast<size_t>(std::max<ssize_t>(0, ::read(ends[0], text.data(), text.size()))));
  ::close(ends[0]);
  ::close(ends[1]);
  EXPECT_THAT(text, HasSubstr(dir())) << "the message names the file";
  EXPECT_THAT(text, ::testing::Not(HasSubstr("nothing was thrown")));
  // With room again the same call goes on.
  run_campaign(campaign, options(dir()));
  EXPECT_EQ(table(dir()), table(dir("whole")));
  reliability("a full disk, or a limit of file sizes", 1, "a sentence, exit status 1; with room again it goes on",
              "running cells");
}

TEST_F(RunsTest, AProgramThatCannotBeStartedIsSaid) {
  const Campaign campaign = faulty_campaign("none");
  pass_gate(campaign, dir());
  RunOptions wrong = options(dir());
  wrong.program = dir("nothing");
  try {
    run_campaign(campaign, wrong);
    FAIL() << "nobody could have measured";
  } catch (const SystemError& error) {
    EXPECT_THAT(error.what(), HasSubstr(dir("nothing")));
    EXPECT_THAT(error.what(), HasSubstr("No such file"));
  }
  // The machine's fault is no engine's result.
  EXPECT_TRUE(Store::open(dir()).cells().empty());
}

// ---- systems of another program's results --------------------------------------------------------------------------------

TEST_F(RunsTest, FactsOfASystemThatCannotBeReadAreAnErrorOfTheInput) {
  Store store = Store::create(dir(), {"c", "h"});
  for (const char* facts : {"", "{", "[]", "{}", R"({"sample_ms": "long"})"}) {
    store.set_systems({{"chain", facts}});
    EXPECT_THROW(fits_samples(store, "chain", 1), InputError) << facts;
  }
  store.set_systems({{"chain", R"({"sample_ms": 4})"}});
  EXPECT_TRUE(fits_samples(store, "chain", 2));
  EXPECT_FALSE(fits_samples(store, "chain", 3));
}

// ---- progress -----------------------------------------------------------------------------------------------------------

std::string drawn(FILE* stream, const std::function<std::string()>& read, double interval_s = kProgressInterval) {
  const auto progress = make_progress(stream, interval_s);
  progress->begin(2, 3, 75);
  progress->phase("accuracy");
  progress->started("drift planar-chain ode-step 1 ms", 75);
  Cell cell;
  cell.measure = "drift";
  progress->finished(cell, 40);
  progress->message("a sentence");
  progress->finished(cell, 0);
  progress->end();
  std::fflush(stream);
  return read();
}

std::string lines(double interval_s) {
  FILE* file = std::tmpfile();
  const auto read = [&] {
    std::fseek(file, 0, SEEK_SET);
    std::string content(10000, '\0');
    content.resize(std::fread(content.data(), 1, content.size(), file));
    return content;
  };
  const std::string text = drawn(file, read, interval_s);
  std::fclose(file);
  return text;
}

TEST(Progress, PlainLinesWhereThereIsNoTerminal) {
  const std::string text = lines(kProgressInterval);
  EXPECT_THAT(text, AllOf(HasSubstr("2 cells to measure, 3 are there already; about 1 min 15 s\n"),
                          HasSubstr("accuracy\n"), HasSubstr("a sentence\n")));
  EXPECT_EQ(text.find('\r'), std::string::npos);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
}

// Cells that are timed together finish together: until then their rounds show that something happens.
TEST(Progress, PlainLinesTellWhatHasBegun) {
  EXPECT_THAT(lines(0),
              AllOf(HasSubstr("3/5 cells, 0 cells/min, 1 min 15 s left; now: drift planar-chain ode-step 1 ms\n"),
                    HasSubstr("4/5 cells, "), HasSubstr("40 s left; last: drift")));
}

TEST(Progress, ABarOnATerminal) {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(terminal, 0);
  ASSERT_EQ(::grantpt(terminal), 0);
  ASSERT_EQ(::unlockpt(terminal), 0);
  FILE* stream = std::fopen(::ptsname(terminal), "w");
  ASSERT_NE(stream, nullptr);
  const std::string text = drawn(stream, [&] {
    // What was written comes in pieces, some of them a moment later.
    std::string content;
    std::array<char, 4096> buffer{};
    pollfd polled = {terminal, POLLIN, 0};
    while (::poll(&polled, 1, 500) > 0) {
      const ssize_t got = ::read(terminal, buffer.data(), buffer.size());
      if (got <= 0) break;
      content.append(buffer.data(), static_cast<size_t>(got));
    }
    return content;
  });
  std::fclose(stream);
  ::close(terminal);
  EXPECT_THAT(text, AllOf(HasSubstr("3/5"), HasSubstr("5/5"), HasSubstr("[========"), HasSubstr("40 s left"),
                          HasSubstr("a sentence"), HasSubstr("drift planar-chain ode-step")));
}

}  // namespace
}  // namespace assay
