#include "results/store/merge.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/regular_file.h"
#include "base/text.h"
#include "measures/batch.h"
#include "measures/measure.h"
#include "results/store/cell_hash.h"
#include "results/store/database.h"
#include "results/store/differences.h"
#include "results/store/facts.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using sql::execute;
using sql::Statement;
using sql::Transaction;

// Entries of the manifest that belong to a machine's part of the work. The union has them of all nodes together.
constexpr std::array<std::string_view, 21> kNodeFacts = {"cpu",
                                                         "cpu_model",
                                                         "cpu_mhz",
                                                         "cpu_cache",
                                                         "cpu_vectors",
                                                         "turbo",
                                                         "cores",
                                                         "governor",
                                                         "virtual_machine",
                                                         "memory",
                                                         "kernel",
                                                         "sandbox",
                                                         "started",
                                                         "finished",
                                                         "wall_s",
                                                         "cpu_s",
                                                         "engine_s",
                                                         "timing_core",
                                                         "clock_cost_ns",
                                                         "engine_share_timing",
                                                         "engine_share_accuracy"};
// And those of one directory: the command that resumes it, a search's answer, the token that its nodes' names come
// from.
constexpr std::array<std::string_view, 3> kDirectoryFacts = {"command", "answer", "part"};

template <size_t kCount>
bool is_listed(const std::array<std::string_view, kCount>& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

json parsed_object(const std::string& text) {
  json facts = json::parse(text, nullptr, /*allow_exceptions=*/false);
  return facts.is_object() ? facts : json::object();
}

struct CloseDatabase {
  void operator()(sqlite3* db) const { sqlite3_close_v2(db); }
};

// A source under the name "src" of a connection.
class Attached {
 public:
  Attached(sqlite3* db, const std::string& dir) : db_(db) {
    const std::string uri = sql::uri_of(dir + "/assay.sqlite");
    attach(uri + "?mode=ro");
    sqlite3_exec(db_, "SELECT count(*) FROM src.sqlite_schema", nullptr, nullptr, nullptr);
    // On a read-only medium SQLite cannot make the index of the write-ahead log; nobody can be writing there either.
    if ((sqlite3_errcode(db_) & 0xff) == SQLITE_CANTOPEN) {
      execute(db_, "DETACH src");
      attach(uri + "?immutable=1");
    }
  }
  ~Attached() { sqlite3_exec(db_, "DETACH src", nullptr, nullptr, nullptr); }
  Attached(const Attached&) = delete;
  Attached& operator=(const Attached&) = delete;

 private:
  void attach(const std::string& uri) { Statement(db_, "ATTACH ? AS src").bind_all(uri).run(); }

  sqlite3* db_;
};

bool attached_has(sqlite3* db, const std::string& table) {
  Statement query(db, "SELECT 1 FROM src.sqlite_schema WHERE type = 'table' AND name = ?");
  query.bind(0, table);
  return query.step();
}

// The columns of a table that both databases have, without its id: "key, system, ...".
std::string common_columns(sqlite3* db, const std::string& table, std::string_view without) {
  const auto columns_in = [&](const char* schema) {
    std::vector<std::string> names;
    Statement query(db, fmt::format("SELECT name FROM pragma_table_info('{}', '{}') ORDER BY cid", table, schema));
    while (query.step()) names.push_back(query.text(0));
    return names;
  };
  const std::vector<std::string> theirs = columns_in("src");
  std::vector<std::string> common;
  for (const std::string& name : columns_in("main")) {
    if (name != without && std::ranges::find(theirs, name) != theirs.end()) common.push_back(name);
  }
  return join(common, ", ");
}

// The machine that timed each system. Speeds compare only where they were measured on one; so do times of many worlds
// on one device, and those of a family for scaling. What is of two kinds is in shards of its own, and no reader
// compares it.
class TimedMachines {
 public:
  bool empty() const { return machine_of_.empty(); }

  // Adds the timings of a database that a connection has under the name `cells_in`; `nodes_in` has its nodes. Cells
  // that name no node are of `unnamed`. Returns what would be of two machines.
  std::optional<std::string> add(sqlite3* db, const char* cells_in, const char* nodes_in, const std::string& unnamed) {
    Statement query(
        db,
        fmt::format("SELECT c.system, c.measure, json_extract(n.json, '$.name'), json_extract(n.json, '$.cpu') FROM "
                    "(SELECT DISTINCT system, measure, {} AS node FROM {}.cells) c JOIN {}.nodes n ON n.id = c.node "
                    "ORDER BY 1, 3, 4, 2",
                    unnamed.empty() ? "node" : fmt::format("'{}'", unnamed), cells_in, nodes_in));
    while (query.step()) {
      const std::string system = query.text(0), measure = query.text(1);
      if (!is_timed(measure)) continue;
      const auto batch = batch_of(measure);
      const std::string kind = batch ? "times of many worlds on " + batch->device : "timings";
      const std::string name = query.text(2), here = name.empty() ? query.text(3) : name;
      const std::string& machine = machine_of_.emplace(std::pair(system, batch ? kind : measure), here).first->second;
      if (machine == here) continue;
      return fmt::format(
          "the {} of '{}' would be of two machines, '{}' and '{}', whose speeds do not compare: measure them in one "
          "shard",
          kind, system, machine, here);
    }
    return std::nullopt;
  }

 private:
  std::map<std::pair<std::string, std::string>, std::string> machine_of_;  // by system and kind
};

// Throws for results that are not what was written, but for samples, which keep their hashes.
void verify_all(const Store& store) {
  static_cast<void>(store.manifest());
  static_cast<void>(store.cells());
  static_cast<void>(store.systems());
  static_cast<void>(store.contenders());
  static_cast<void>(store.conformance());
  static_cast<void>(store.runs());
  static_cast<void>(store.scenes());
  static_cast<void>(store.nodes());
  static_cast<void>(store.plan());
}

class Merge {
 public:
  Merge(sqlite3* db, Store& out, const std::vector<std::string>& derived) : db_(db), out_(out) {
    std::vector<std::string> quoted;
    quoted.reserve(derived.size());
    for (const std::string& name : derived) quoted.push_back(fmt::format("'{}'", name));
    derived_ = join(quoted, ", ");
  }

  void add(const std::string& dir, MergeSummary& summary) {
    dir_ = dir;
    const Store source = Store::open(dir);
    verify_all(source);  // before SQL copies it row by row
    const Attached attached(db_, dir);
    Transaction transaction(db_);
    changed_tables_.clear();
    match_cells();
    note_change("manifest", [&] { merge_manifest(source); });
    note_change("nodes", [&] { merge_nodes(source); });
    refuse_other_cells();
    refuse_other_runs();
    refuse_other_verdicts();
    const std::int64_t before = count("src.cells");
    const std::int64_t added = merge_cells();
    merge_lists();
    refuse_mixed_machines();
    for (const std::string& table : changed_tables_) sql::put_table_hash(db_, table);
    summary.trajectories += copy_files("trajectories", ".bin");
    summary.trajectories += copy_files("parity", ".json");
    transaction.commit();
    summary.cells += static_cast<size_t>(added);
    summary.cells_before += static_cast<size_t>(before - added);
  }

  // Entries of the manifest that all nodes make up together.
  void summarize() {
    std::map<std::string, std::map<std::string, int>> facts;
    std::map<std::string, double> sums;
    std::string started, finished;
    for (const NodeRow& row : out_.nodes()) {
      const json node = parsed_object(row.json);
      for (const auto& [key, value] : node.items()) {
        if (!is_listed(kNodeFacts, key) || !value.is_string()) continue;
        const std::string text = value.get<std::string>();
        if (key == "started") {
          if (started.empty() || text < started) started = text;
        } else if (key == "finished") {
          finished = std::max(finished, text);
        } else if (key == "wall_s" || key == "cpu_s" || key == "engine_s") {
          sums[key] += parse_number(text).value_or(0);
        } else if (!key.starts_with("engine_share")) {
          ++facts[key][text];
        }
      }
    }
    std::vector<ManifestEntry> entries;
    for (const auto& [key, texts] : facts) {
      std::vector<std::string> parts;
      for (const auto& [text, nodes] : texts) parts.push_back(text);
      entries.push_back({key, join(parts, "; ")});
    }
    for (const auto& [key, sum] : sums) entries.push_back({key, fmt::format("{:.1f}", sum)});
    if (!started.empty()) entries.push_back({"started", started});
    if (!finished.empty()) entries.push_back({"finished", finished});
    double timing_engine = 0, timing_wall = 0, accuracy_engine = 0, accuracy_cpu = 0;
    for (const auto& [measure, spent] : out_.spent()) {
      const bool steps = reads(measure, Reads::kSteps);
      if (is_timed(measure) && !steps) continue;
      (steps ? timing_engine : accuracy_engine) += spent.engine_s;
      (steps ? timing_wall : accuracy_cpu) += steps ? spent.wall_s : spent.cpu_s;
    }
    const auto share = [&](const char* key, double part, double whole) {
      if (whole > 0) entries.push_back({key, fmt::format("{:.3f}", part / whole)});
    };
    share("engine_share_timing", timing_engine, timing_wall);
    share("engine_share_accuracy", accuracy_engine, accuracy_cpu);
    out_.set_manifest(entries);
    sql::put_table_hash(db_, "plan");
  }

 private:
  std::int64_t count(const std::string& table) {
    Statement query(db_, "SELECT count(*) FROM " + table);
    return query.step() ? query.integer(0) : 0;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(fmt::format("'{}' does not fit into '{}': {}; nothing of it was taken", dir_, out_.dir(), what));
  }

  void merge_manifest(const Store& source) {
    Statement put(db_, "INSERT OR IGNORE INTO manifest VALUES(?, ?)");
    for (const auto& [key, value] : source.manifest()) {
      if (is_listed(kNodeFacts, key) || is_listed(kDirectoryFacts, key)) continue;
      const auto there = out_manifest(key);
      if (there && *there != value) {
        refuse(fmt::format("its manifest's '{}' is '{}', and there it is '{}'", key, value, *there));
      }
      put.bind_all(key, value).run();
    }
  }

  std::optional<std::string> out_manifest(const std::string& key) {
    Statement query(db_, "SELECT value FROM manifest WHERE key = ?");
    query.bind(0, key);
    if (!query.step()) return std::nullopt;
    return query.text(0);
  }

  void merge_nodes(const Store& source) {
    std::vector<NodeRow> nodes = source.nodes();
    unnamed_node_.clear();
    // Written before nodes were stored: its machine is the manifest's. One without cells was only begun.
    if (nodes.empty() && count("src.cells") > 0) {
      json facts = json::object();
      for (const auto& [key, value] : source.manifest()) {
        if (is_listed(kNodeFacts, key)) facts[key] = value;
      }
      json content = {source.manifest("campaign_hash").value_or("")};
      for (const char* key : {"cpu", "cores", "memory", "kernel", "started"}) content.push_back(text_fact(facts, key));
      constexpr size_t kDigits = 16;
      unnamed_node_ = content_hash(dump_json(content)).substr(0, kDigits);
      nodes.push_back({unnamed_node_, dump_json(facts)});
    }
    Statement put(db_, "INSERT OR REPLACE INTO nodes VALUES(?, ?)");
    const auto order = [](const std::string& text) {  // the later state of a part's work comes last
      return std::pair(text_fact(parsed_object(text), "finished"), text);
    };
    for (const NodeRow& node : nodes) {
      Statement there(db_, "SELECT json FROM nodes WHERE id = ?");
      there.bind(0, node.id);
      const bool known = there.step();
      const std::string before = known ? there.text(0) : "";
      if (!known || order(before) < order(node.json)) put.bind_all(node.id, node.json).run();
    }
  }

  static std::string cell_text(const Statement& row, int at) {
    return fmt::format("{} of {} on {} at {} ms", row.text(at), row.text(at + 1), row.text(at + 2),
                       timestep_label(row.number(at + 3)));
  }

  static std::string advice(const std::string& measure) {
    return is_timed(measure)
               ? "a timing that was measured twice: leave one of the two out"
               : "the same run gave two results, so engines, processors or libraries differ: leave one of the two out";
  }

  // Which cells of the source are there already, and which it adds or replaces: of two equal cells the one that was
  // measured first stays, whichever comes first here. All else reads these tables, so that a key is looked up once.
  // A cell's id in the union is its `place` behind `last_id_`, so that rows are written in the order of their table.
  void match_cells() {
    execute(db_, "DROP TABLE IF EXISTS temp.matched");
    execute(db_, "DROP TABLE IF EXISTS temp.merged");
    execute(db_, "CREATE TEMP TABLE matched(old INTEGER PRIMARY KEY, there INTEGER, is_first INTEGER)");
    execute(db_, "CREATE TEMP TABLE merged(place INTEGER PRIMARY KEY, old INTEGER NOT NULL, there INTEGER)");
    execute(
        db_,
        "INSERT INTO temp.matched SELECT s.id, m.id, m.id IS NULL OR (s.started, s.finished, s.wall_s) < (m.started, "
        "m.finished, m.wall_s) FROM src.cells s LEFT JOIN main.cells m ON m.key = s.key ORDER BY s.id");
    execute(db_, "INSERT INTO temp.merged(old, there) SELECT old, there FROM temp.matched WHERE is_first ORDER BY old");
    any_there_ = count("temp.matched WHERE there IS NOT NULL") > 0;
  }

  void refuse_other_cells() {
    if (!any_there_) return;
    {
      Statement query(
          db_,
          "SELECT s.measure, s.contender, s.system, s.timestep_ms, s.outcome, m.outcome FROM temp.matched t "
          "CROSS JOIN src.cells s ON s.id = t.old CROSS JOIN main.cells m ON m.id = t.there "
          "WHERE s.outcome <> m.outcome LIMIT 1");
      if (query.step()) {
        refuse(fmt::format("{} is '{}' in it and '{}' there, {}", cell_text(query, 0), query.text(4), query.text(5),
                           advice(query.text(0))));
      }
    }
    // Either may have a value that the other lacks. CROSS JOIN keeps the order: what is there may be much more.
    for (const auto& [one, other, swapped] : {std::tuple("src", "main", false), std::tuple("main", "src", true)}) {
      Statement query(
          db_,
          fmt::format(
              "SELECT s.measure, s.contender, s.system, s.timestep_ms, v.name, v.value, w.value FROM temp.matched t "
              "CROSS JOIN {0}.\"values\" v ON v.cell_id = t.{2} "
              "LEFT JOIN {1}.\"values\" w ON w.cell_id = t.{3} AND w.name = v.name "
              "LEFT JOIN src.cells s ON s.id = t.old "
              "WHERE t.there IS NOT NULL AND v.name NOT IN ({4}) AND (v.value IS NOT w.value OR v.low IS NOT w.low "
              "OR v.high IS NOT w.high OR w.name IS NULL) LIMIT 1",
              one, other, swapped ? "there" : "old", swapped ? "old" : "there", derived_));
      if (!query.step()) continue;
      const auto shown = [&](int column) {
        const auto number = query.optional_number(column);
        return number ? digits17(*number) : std::string("none");
      };
      refuse(fmt::format("{} has another '{}': {} in it and {} there, {}", cell_text(query, 0), query.text(4),
                         shown(swapped ? 6 : 5), shown(swapped ? 5 : 6), advice(query.text(0))));
    }
  }

  void refuse_other_runs() {
    if (!attached_has(db_, "runs")) return;
    Statement query(
        db_,
        "SELECT s.system, s.contender, s.timestep_ms FROM src.runs s CROSS JOIN main.runs m ON m.system = s.system "
        "AND m.contender = s.contender AND m.timestep_ms = s.timestep_ms WHERE s.address <> m.address LIMIT 1");
    if (query.step()) {
      refuse(fmt::format("the kept run of {} on {} at {} ms is another", query.text(1), query.text(0),
                         timestep_label(query.number(2))));
    }
  }

  void refuse_other_verdicts() {
    Statement query(
        db_,
        "SELECT s.contender, s.test, s.status, m.status FROM src.conformance s CROSS JOIN main.conformance m ON "
        "m.contender = s.contender AND m.test = s.test WHERE s.status <> m.status LIMIT 1");
    if (query.step()) {
      refuse(fmt::format("the test '{}' of the conformance suite gave '{}' for {} in it and '{}' there", query.text(1),
                         query.text(2), query.text(0), query.text(3)));
    }
  }

  // The number of cells that are new.
  std::int64_t merge_cells() {
    const std::int64_t fresh = count("temp.merged WHERE there IS NULL");
    // Foreign keys are off on this connection, because checking them for each sample takes as long as copying it.
    if (any_there_) {
      for (const auto& [table, id] : {std::pair("samples", "cell_id"), {"values", "cell_id"}, {"cells", "id"}}) {
        execute(db_,
                fmt::format("DELETE FROM main.\"{}\" WHERE {} IN (SELECT there FROM temp.merged)", table, id).c_str());
      }
    }
    last_id_ = 0;
    {
      Statement query(db_, "SELECT max(id) FROM main.cells");
      if (query.step()) last_id_ = query.integer(0);
    }
    const std::string cells = common_columns(db_, "cells", "id");
    // OR ROLLBACK, as anything that fails does here: so SQLite keeps no journal of what a statement has changed.
    execute(db_,
            fmt::format(
                "INSERT OR ROLLBACK INTO main.cells(id, {0}) SELECT {1} + t.place, {0} FROM temp.merged t CROSS JOIN "
                "src.cells s ON s.id = t.old ORDER BY t.place",
                cells, last_id_)
                .c_str());
    for (const char* table : {"values", "samples"}) {
      const std::string columns = common_columns(db_, table, "cell_id");
      const std::string where =
          std::string_view(table) == "values" ? fmt::format(" WHERE name NOT IN ({})", derived_) : "";
      execute(
          db_,
          fmt::format("INSERT OR ROLLBACK INTO main.\"{0}\"(cell_id, {1}) SELECT {2} + t.place, {1} FROM temp.merged t "
                      "CROSS JOIN src.\"{0}\" v ON v.cell_id = t.old{3} ORDER BY t.place",
                      table, columns, last_id_, where)
              .c_str());
    }
    hash_cells();
    return fresh;
  }

  // Cells keep the hashes that they were written with, but for those that are not quite what they were.
  void hash_cells() {
    if (!unnamed_node_.empty()) {
      Statement(db_, fmt::format("UPDATE main.cells SET node = ? WHERE id > {}", last_id_))
          .bind_all(unnamed_node_)
          .run();
    }
    std::vector<std::int64_t> changed, unhashed;
    {
      Statement query(db_, fmt::format("SELECT m.id, m.hash IS NULL FROM main.cells m WHERE m.id > {0} AND ({1} OR "
                                       "m.hash IS NULL OR m.id IN (SELECT {0} + t.place FROM temp.merged t JOIN "
                                       "src.\"values\" v ON v.cell_id = t.old WHERE v.name IN ({2})))",
                                       last_id_, unnamed_node_.empty() ? "0" : "1", derived_));
      while (query.step()) {
        changed.push_back(query.integer(0));
        if (query.integer(1) != 0) unhashed.push_back(query.integer(0));
      }
    }
    sql::CellHasher hasher(db_);
    for (const std::int64_t id : unhashed) hasher.put_samples_hash(id);
    for (const std::int64_t id : changed) hasher.put_cell_hash(id);
  }

  // Hashing a table takes time that grows with it: only those that `work` has changed are hashed anew.
  void note_change(const std::string& table, const std::function<void()>& work) {
    const std::int64_t before = sqlite3_total_changes64(db_);
    work();
    if (sqlite3_total_changes64(db_) != before) changed_tables_.insert(table);
  }

  void merge_list(const std::string& table, const std::string& statement) {
    note_change(table, [&] { execute(db_, statement.c_str()); });
  }

  void merge_lists() {
    // systems and contenders as the campaign lists them; rows of one campaign are equal but for paths
    merge_list("systems", "INSERT OR IGNORE INTO main.systems SELECT name, json FROM src.systems ORDER BY rowid");
    merge_list(
        "systems",
        "UPDATE main.systems SET json = (SELECT s.json FROM src.systems s WHERE s.name = main.systems.name) "
        "WHERE EXISTS (SELECT 1 FROM src.systems s WHERE s.name = main.systems.name AND s.json < main.systems.json)");
    const std::string contenders = common_columns(db_, "contenders", "");
    merge_list("contenders",
               fmt::format("INSERT OR IGNORE INTO main.contenders({0}) SELECT {0} FROM src.contenders ORDER BY rowid",
                           contenders));
    const std::string verdicts = common_columns(db_, "conformance", "");
    merge_list("conformance",
               fmt::format("INSERT OR IGNORE INTO main.conformance({0}) SELECT {0} FROM src.conformance ORDER BY rowid",
                           verdicts));
    merge_list(
        "conformance",
        "UPDATE main.conformance SET (figure, tolerance, unit, note) = (SELECT s.figure, s.tolerance, s.unit, s.note "
        "FROM src.conformance s WHERE s.contender = main.conformance.contender AND s.test = main.conformance.test) "
        "WHERE EXISTS (SELECT 1 FROM src.conformance s WHERE s.contender = main.conformance.contender AND s.test = "
        "main.conformance.test AND (s.figure, s.note) < (main.conformance.figure, main.conformance.note))");
    if (attached_has(db_, "runs")) {
      merge_list("runs",
                 "INSERT OR IGNORE INTO main.runs(system, contender, timestep_ms, address) SELECT system, contender, "
                 "timestep_ms, address FROM src.runs");
    }
    if (attached_has(db_, "scenes")) {
      merge_list("scenes", "INSERT OR IGNORE INTO main.scenes(system, json) SELECT system, json FROM src.scenes");
    }
    if (attached_has(db_, "plan")) {
      execute(db_,
              "INSERT INTO main.plan SELECT key, shard, cost_s, accuracy FROM src.plan WHERE true ON CONFLICT(key) DO "
              "UPDATE SET shard = min(shard, excluded.shard)");
      // It grows with every source, so it is hashed once, by summarize(). Without a hash nothing is expected of it.
      execute(db_, "DELETE FROM main.hashes WHERE name = 'plan'");
    }
  }

  void refuse_mixed_machines() {
    // Of the union that is there, once; then each source adds its own.
    const bool first = machines_.empty();
    const std::string unnamed = first ? "" : unnamed_node_;
    if (const auto mixed = machines_.add(db_, first ? "main" : "src", "main", unnamed)) refuse(*mixed);
  }

  // Files that lie beside the database, named by what they follow from: linked where both lie in one file system.
  size_t copy_files(const std::string& folder, const std::string& ending) {
    const fs::path from = fs::path(dir_) / folder, to = fs::path(out_.dir()) / folder;
    std::error_code error;
    size_t copied = 0;
    for (const auto& entry : fs::directory_iterator(from, error)) {
      if (entry.path().extension() != ending) continue;
      const fs::path target = to / entry.path().filename();
      // What a link means may be no part of the results, and a pipe would be waited for.
      for (const fs::path& file : {entry.path(), target}) {
        if (const std::string other = other_than_file(file.string()); !other.empty()) {
          refuse(fmt::format("'{}' is {} and not a regular file: remove it", file.string(), other));
        }
      }
      if (fs::exists(target, error)) {
        if (!same_file(entry.path(), target)) {
          refuse(fmt::format("'{}' has another content there: the same run gave two results", entry.path().string()));
        }
        continue;
      }
      fs::create_directories(to, error);
      if (error) throw SystemError(fmt::format("cannot make the directory '{}': {}", to.string(), error.message()));
      copy_file(entry.path(), target);
      ++copied;
    }
    return copied;
  }

  static bool same_file(const fs::path& a, const fs::path& b) {
    std::error_code error;
    if (fs::equivalent(a, b, error)) return true;
    if (fs::file_size(a, error) != fs::file_size(b, error)) return false;
    std::ifstream one(a, std::ios::binary), other(b, std::ios::binary);
    std::array<char, 1 << 16> left{}, right{};
    while (one && other) {
      one.read(left.data(), left.size());
      other.read(right.data(), right.size());
      if (one.gcount() != other.gcount() || !std::equal(left.begin(), left.begin() + one.gcount(), right.begin())) {
        return false;
      }
    }
    return true;
  }

  static void copy_file(const fs::path& from, const fs::path& to) {
    std::error_code error;
    fs::create_hard_link(from, to, error);
    if (!error) return;
    const fs::path partial = fmt::format("{}.{}.tmp", to.string(), ::getpid());
    fs::remove(partial, error);  // a link that lies there is not followed
    fs::copy_file(from, partial, error);
    if (!error) fs::rename(partial, to, error);
    if (!error) return;
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw SystemError(fmt::format("cannot copy '{}' to '{}': {}", from.string(), to.string(), error.message()));
  }

  sqlite3* db_;
  Store& out_;
  std::string derived_;                   // names as a list of SQL
  std::string dir_;                       // of the source
  std::string unnamed_node_;              // the machine of a source without nodes
  bool any_there_ = false;                // whether the union has some of the source's cells
  std::int64_t last_id_ = 0;              // of the union's cells before the source's
  std::set<std::string> changed_tables_;  // by this source
  TimedMachines machines_;                // of the union
};

// A directory whose process was killed before it had stored more than the campaign's name.
bool is_only_begun(const Description& results) {
  return results.fact("assay_version").empty() && results.systems.empty() && results.contenders.empty();
}

// Two directories are parts of one campaign: else one sentence says what differs.
void refuse_another_campaign(const Description& first, const Description& other) {
  std::vector<Difference> found = differences(first, other);
  // It holds nothing of any program yet.
  if (is_only_begun(first) || is_only_begun(other))
    std::erase_if(found, [](const Difference& each) { return each.kind == DifferenceKind::kProgram; });
  const auto of_program = std::ranges::find(found, DifferenceKind::kProgram, &Difference::kind);
  const std::string campaign = first.fact("campaign"), others = other.fact("campaign");
  const bool same = campaign == others && first.fact("campaign_hash") == other.fact("campaign_hash");
  if (same && of_program == found.end()) return;
  std::string why;
  if (campaign != others) {
    why = fmt::format("'{}' has the campaign '{}' and '{}' has '{}'", first.dir, campaign, other.dir, others);
  } else {
    const auto difference = std::ranges::find_if(found, [&](const Difference& each) {
      return same ? each.kind == DifferenceKind::kProgram
                  : each.kind != DifferenceKind::kProgram && each.kind != DifferenceKind::kMachine;
    });
    const auto said = difference != found.end() ? difference : of_program;
    why = said != found.end() ? said->text(first.dir, other.dir) : "the campaign's time limit or timesteps differ";
  }
  throw InputError(
      fmt::format("'{}' and '{}' are no parts of one campaign: {}; measure both again with one program and "
                  "one campaign file",
                  first.dir, other.dir, why));
}

// False for a database that a process which was killed had only begun.
bool has_content(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  const std::unique_ptr<sqlite3, CloseDatabase> db(sql::open_to_read(path));
  return sql::pragma(db.get(), "schema_version") != 0 || sql::pragma(db.get(), "application_id") != 0;
}

std::optional<std::string> add_machines(const std::string& dir, TimedMachines& machines) {
  const std::unique_ptr<sqlite3, CloseDatabase> db(sql::open_to_read(dir + "/assay.sqlite"));
  if (!sql::has_table(db.get(), "nodes")) return std::nullopt;  // of version 1: Merge gives it a node
  return machines.add(db.get(), "main", "main", "");
}

bool same_directory(const std::string& a, const std::string& b) {
  std::error_code error;
  return fs::equivalent(a, b, error);
}

}  // namespace

MergeSummary merge_results(const std::vector<std::string>& sources, const std::string& out,
                           const std::vector<std::string>& derived,
                           const std::function<void(const std::string& source)>& begin,
                           const std::function<void(Store& merged)>& finish,
                           const std::function<void(const Store& source)>& check) {
  if (sources.empty()) throw InputError("there is nothing to merge: name results directories");
  // Before anything is written.
  Description first = describe(Store::open(sources.front()));
  for (const std::string& source : sources) {
    const Store opened = Store::open(source);
    Description other = describe(opened);
    if (check) check(opened);
    refuse_another_campaign(first, other);
    if (is_only_begun(first)) first = std::move(other);
  }
  if (has_content(out + "/assay.sqlite")) {
    const Store there = Store::open(out);
    refuse_another_campaign(first, describe(there));
    verify_all(there);  // its tables are changed and hashed anew, after which no damage shows
  }

  // What follows from single cells is found when their source's turn comes.
  TimedMachines machines;
  if (has_content(out + "/assay.sqlite")) static_cast<void>(add_machines(out, machines));
  for (const std::string& source : sources) {
    if (same_directory(source, out)) continue;
    if (const auto mixed = add_machines(source, machines)) {
      throw InputError(fmt::format("'{}' does not fit into '{}': {}; nothing was merged", source, out, *mixed));
    }
  }

  MergeSummary summary;
  Store result = Store::create(out, {first.fact("campaign"), first.fact("campaign_hash")});
  std::string refused;
  {
    const std::unique_ptr<sqlite3, CloseDatabase> db(
        sql::open_database(sql::uri_of(out + "/assay.sqlite"), SQLITE_OPEN_READWRITE | SQLITE_OPEN_URI));
    execute(db.get(), "PRAGMA synchronous = FULL; PRAGMA foreign_keys = OFF; PRAGMA cache_size = -65536");  // KiB
    // Every commit is synced; only pages that many sources change reach the database less often.
    execute(db.get(), "PRAGMA wal_autocheckpoint = 8192; PRAGMA temp_store = MEMORY");
    Merge merge(db.get(), result, derived);
    for (const std::string& source : sources) {
      if (same_directory(source, out)) continue;  // all of it is there
      if (begin) begin(source);
      try {
        merge.add(source, summary);
      } catch (const InputError& error) {
        if (summary.sources == 0) throw;
        refused = error.what();
        break;
      }
      ++summary.sources;
    }
    merge.summarize();
  }
  if (finish) finish(result);
  if (!refused.empty()) {
    throw InputError(fmt::format("{}; {} before it {} merged", refused,
                                 counted(summary.sources, "directory", "directories"),
                                 summary.sources == 1 ? "was" : "were"));
  }
  return summary;
}

}  // namespace assay
