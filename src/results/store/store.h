// The results directory: DIR/assay.sqlite holds everything a table or a plot needs, DIR/trajectories/ the runs that
// were kept. One process writes (Store::create), any number read (Store::open), also while it writes.
//
// Schema, version kSchemaVersion (SQLite's user_version). An absent number is NULL, never NaN. Key columns come first:
//   manifest(key, value)
//   systems(name, json)
//   contenders(name, engine, version, base, settings, capabilities_json, build_json)
//   conformance(contender, test, status, figure, tolerance, unit, note)
//   cells(id, key UNIQUE, system, contender, timestep_ms, measure, outcome, reason, wall_s, cpu_s, engine_s, steal,
//         started, finished, node, samples_hash, hash)
//   "values"(cell_id, name, unit, value, low, high)
//   samples(cell_id, name, idx, value)
//   runs(system, contender, timestep_ms, address): owners of the states in trajectories/
//   scenes(system, json): what a picture of the system needs (results/store/scene.h)
//   nodes(id, json): the machines that measured, each with the facts of its part of the work
//   plan(key, shard, cost_s, accuracy): the cells that this directory, or one that was merged into it, was to measure
//   hashes(name, hash): of the content of each table but cells, values, samples; older results have none of plan
// A cell's `hash` covers its columns but the id, its values and `samples_hash`, which covers its samples. What is read
// is compared with its hash: bits that changed on the disk are found, deliberate changes are not. Version 1 has no
// hashes, nodes and plan, `address` comes first in `runs`, and `runs` and `scenes` may be missing. It is read as it is;
// create() makes it version 2.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "measures/value.h"

struct sqlite3;

namespace assay {

inline constexpr int kSchemaVersion = 2;

// The contender that does nothing: it measures the harness itself and takes part in no comparison.
inline constexpr const char* kHarness = "null";

// "ok", "unstable", "diverged", "timeout", "crashed", "unsupported" as stored.
enum class Outcome { kOk, kUnstable, kDiverged, kTimeout, kCrashed, kUnsupported };
std::string_view outcome_text(Outcome outcome);
std::optional<Outcome> parse_outcome(std::string_view text);

// The unit of work: contender x system x timestep x measure. What is interrupted loses whole cells.
struct Cell {
  std::int64_t id = 0;  // set by the store
  std::string key;      // content address of everything that the result depends on
  std::string system;
  std::string contender;
  double timestep_ms = 0;
  std::string measure;  // measures/measure.h
  Outcome outcome = Outcome::kOk;
  std::string reason;   // "" for ok
  double wall_s = 0;    // of the worker, or its part of a worker that served several cells
  double cpu_s = 0;     // of the same
  double engine_s = 0;  // inside the engine's steps: processor time of runs, wall time of timings
  double steal = 0;     // share of the machine's time that the host took meanwhile, 0 to 1
  double started = 0;   // seconds since 1970
  double finished = 0;
  std::string node;  // that measured it: NodeRow::id; "" where that was not stored. put_cell() takes the store's node.
  std::vector<Value> values;
};

struct MeasuredCell {
  Cell cell;
  std::vector<SampleSeries> samples;
};

// The cell's value of this name; null when there is none or it has no number.
const Value* find_value(const Cell& cell, std::string_view name);

struct ManifestEntry {
  std::string key, value;
};

struct SystemRow {
  std::string name;
  std::string
      json;  // {"model_hash", "dof", "bodies", "hinges", "shapes", "contact_pairs", "mass_kg", "duration_s", ...}
};

// A setting of a contender that differs from its adapter's default.
struct SettingChange {
  std::string setting, value;  // as in `--set`
  std::string otherwise = {};  // the default; "" in results that do not tell it
  std::string unit = {}, meaning = {};
};
struct ContenderRow {
  std::string name;
  std::string engine;    // the plugin's name; "" with `version` empty when the engine is absent
  std::string version;   // the engine's own
  std::string base;      // the contender that it was derived from; the name itself when it was not
  std::string settings;  // what differs from the adapter's defaults: "key=value key=value"
  std::string capabilities_json;
  std::string build_json;  // {"version", "source", "compiler", "flags", "plugin"}
  // Read from the texts above by Store::contenders(), and not written.
  std::vector<SettingChange> changes = {};  // its settings, in the order of their declaration
  std::string contact_forces = {};          // that its engine gives: "none", "normal", "all"; "" where that is unknown
};

struct ConformanceRow {
  std::string contender, test;
  std::string status;  // "pass", "fail", "deviation", "not-applicable"
  double figure = 0, tolerance = 0;
  std::string unit, note;
};

// A run from the initial state and the file of its states: all samples, or only the last state where the run was made
// for its time (scaling). A run that failed has no file.
struct RunRow {
  std::string address;  // of results/store/trajectory.h
  std::string system, contender;
  double timestep_ms = 0;
};

struct SceneRow {
  std::string system;
  std::string json;  // results/store/scene.h
};

// A machine and its part of a campaign's work: one results directory on one machine, whatever number of runs it took.
struct NodeRow {
  std::string id;
  // {"name", "cpu", "cores", ... (run/coordinator/machine.h), "shard": "2/8", "part", "jobs", "started", "finished",
  // "wall_s", "cpu_s", "engine_s"}
  std::string json;
};

// A cell that is to be measured.
struct PlanRow {
  std::string key;
  int shard = 1;
  double cost_s = 0;     // estimated seconds of one worker
  bool accuracy = true;  // false: its figure is a time
};

// What a results directory belongs to. Two runs may share a directory when all of it is equal.
struct Identity {
  std::string campaign;       // name
  std::string campaign_hash;  // of all that decides which cells there are
};

class Store {
 public:
  // Opens `dir` for writing: makes the directory and the database when they are not there, goes on when they are.
  // Throws InputError when `dir` holds another campaign's results, results that open() refuses, something else
  // under the name assay.sqlite, or when another process is writing to it; nothing is changed then. Results of version
  // 1 become version 2. Throws SystemError when the directory cannot be written or the disk is full.
  static Store create(const std::string& dir, const Identity& identity);

  // Opens the results of `dir` for reading, on a read-only medium too. Throws InputError when it holds none, or those
  // of an unknown schema version, a table or column is missing, or there is anything that assay does not make: a
  // trigger, a view, another table, a pipe beside the database. Nothing of that is run. A damaged database throws
  // InputError that says where the damage is: here, as far as SQLite's integrity check comes in kIntegritySeconds, or
  // when the damaged part is read. Cells whose outcome or timestep cannot be are refused when they are read.
  static Store open(const std::string& dir);

  Store(Store&& other) noexcept;
  Store& operator=(Store&& other) noexcept;
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;
  ~Store();

  static constexpr double kIntegritySeconds = 1;

  const std::string& dir() const { return dir_; }
  std::string trajectories_dir() const { return dir_ + "/trajectories"; }

  // ---- reading; every list is in a fixed order that depends on the content alone ------------------------------------

  std::vector<ManifestEntry> manifest() const;  // by key
  std::optional<std::string> manifest(const std::string& key) const;
  std::vector<SystemRow> systems() const;           // as the campaign lists them
  std::vector<ContenderRow> contenders() const;     // as the campaign lists them
  std::vector<ConformanceRow> conformance() const;  // by contender as listed, then in the suite's order
  std::vector<Cell> cells() const;             // with values; by system and contender as listed, then measure, timestep
  std::vector<std::string> cell_keys() const;  // sorted
  std::vector<SampleSeries> samples(std::int64_t cell_id) const;
  std::vector<RunRow> runs() const;      // by system and contender as listed, then timestep
  std::vector<SceneRow> scenes() const;  // by system as listed
  std::vector<NodeRow> nodes() const;    // by id
  std::vector<PlanRow> plan() const;     // by key
  // The time that the cells of a measure took, by measure.
  struct Spent {
    double wall_s = 0, cpu_s = 0, engine_s = 0;
  };
  std::map<std::string, Spent> spent() const;
  // How far the plan is, by shard and kind.
  struct PartDone {
    int shard = 1;
    bool accuracy = true;
    size_t cells = 0, done = 0;
    double cost_s = 0, cost_done_s = 0;  // as planned
    double wall_s = 0;                   // that the done cells took
  };
  std::vector<PartDone> plan_done() const;
  // Whether a process is writing to the results directory now, as far as its file system tells.
  static bool is_written(const std::string& dir);

  // ---- writing; each call is one transaction: afterwards it is all there, or nothing of it ----------------------------
  // All throw SystemError when the database cannot be written (disk full).

  void set_manifest(const std::vector<ManifestEntry>& entries);  // replaces entries of the same key
  void set_systems(const std::vector<SystemRow>& rows);          // replaces all
  void set_contenders(const std::vector<ContenderRow>& rows);    // replaces all
  void set_runs(const std::vector<RunRow>& rows);                // replaces all
  void set_scenes(const std::vector<SceneRow>& rows);            // replaces all
  void set_node(const NodeRow& row);  // replaces that of the same id; cells that follow are measured on it
  void set_plan(const std::vector<PlanRow>& rows);  // replaces all
  // Replaces the contender's rows.
  void set_conformance(const std::string& contender, const std::vector<ConformanceRow>& rows);
  // Adds a finished cell with its values and samples; replaces one of the same key. Returns its id.
  std::int64_t put_cell(const Cell& cell, const std::vector<SampleSeries>& samples = {});
  // The same of cells that were measured together.
  void put_cells(const std::vector<MeasuredCell>& cells);
  // Values that follow from several cells (order of convergence, floors): replaces all values of these names.
  struct Derived {
    std::int64_t cell_id = 0;
    Value value;
  };
  void set_derived(const std::vector<std::string>& names, const std::vector<Derived>& values);
  // Removes the cells that are not what was written, their samples included, so that they are measured again. Returns a
  // title each: "drift of chain, ode-quick at 1 ms".
  std::vector<std::string> remove_damaged_cells();

 private:
  struct Deleter {
    void operator()(sqlite3* db) const;
  };
  Store(std::string dir, std::unique_ptr<sqlite3, Deleter> db, int lock);

  std::string database() const { return dir_ + "/assay.sqlite"; }
  void verify(const std::string& table) const;
  std::int64_t insert_cell(const Cell& cell, const std::vector<SampleSeries>& samples);
  std::vector<Cell> read_cells(std::vector<Cell>& damaged) const;

  std::string dir_;
  std::unique_ptr<sqlite3, Deleter> db_;
  int lock_ = -1;       // descriptor that holds the writer's lock
  bool hashed_ = true;  // false: version 1, opened for reading
  std::string node_;    // of cells that are put
};

}  // namespace assay
