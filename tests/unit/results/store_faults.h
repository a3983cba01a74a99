// What tests of damaged results share: a results directory with everything in it, and ways to change and read it.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "results/store/store.h"
#include "temp_folder.h"

namespace assay {

inline const Identity kCampaign = {"faults", "0123"};

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ostringstream content;
  content << std::ifstream(path, std::ios::binary).rdbuf();
  return content.str();
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

inline Cell numbered_cell(int number) {
  Cell cell;
  cell.key = fmt::format("key{:04}", number);
  cell.system = "chain";
  cell.contender = "ode-quick";
  cell.timestep_ms = 1 + number;
  cell.measure = "consistency";
  cell.wall_s = 0.5 * number;
  cell.values = {{"consistency", "m", 1e-5 * (1 + number), 0.9e-5, 1.1e-5}, {"restart_floor", "m", {}, {}, {}}};
  return cell;
}

inline std::vector<SampleSeries> numbered_samples(int number, int count) {
  SampleSeries series = {"piece_error_m", {}};
  for (int i = 0; i < count; ++i) series.values.push_back(0.001 * i + number);
  return {series};
}

// Everything that can be read, as a text.
inline std::string content_of(const Store& store) {
  std::string text;
  for (const auto& [key, value] : store.manifest()) text += fmt::format("{}={}\n", key, value);
  for (const SystemRow& row : store.systems()) text += row.name + row.json + "\n";
  for (const ContenderRow& row : store.contenders())
    text += row.name + row.engine + row.settings + row.build_json + "\n";
  for (const ConformanceRow& row : store.conformance()) {
    text += fmt::format("{} {} {} {} {} {}\n", row.contender, row.test, row.status, row.figure, row.unit, row.note);
  }
  for (const RunRow& row : store.runs()) {
    text += fmt::format("{} {} {} {}\n", row.address, row.system, row.contender, row.timestep_ms);
  }
  for (const SceneRow& row : store.scenes()) text += row.system + row.json + "\n";
  for (const NodeRow& row : store.nodes()) text += row.id + row.json + "\n";
  for (const PlanRow& row : store.plan()) {
    text += fmt::format("{} {} {} {}\n", row.key, row.shard, row.cost_s, row.accuracy);
  }
  for (const Cell& cell : store.cells()) {
    text += fmt::format("{} {} {} {} {} {} {} {} {} {}\n", cell.key, cell.system, cell.contender, cell.timestep_ms,
                        cell.measure, outcome_text(cell.outcome), cell.reason, cell.wall_s, cell.started, cell.steal);
    for (const Value& value : cell.values) {
      text += fmt::format(" {} {} {} {} {}", value.name, value.unit, value.value.value_or(-1), value.low.value_or(-1),
                          value.high.value_or(-1));
    }
    for (const SampleSeries& series : store.samples(cell.id)) {
      text += series.name;
      for (const double sample : series.values) text += fmt::format(" {}", sample);
    }
  }
  return text;
}

inline void fill(const std::string& dir, int cells, int samples) {
  Store store = Store::create(dir, kCampaign);
  store.set_manifest({{"cpu", "x"}, {"assay_version", "9.8"}});
  store.set_systems({{"chain", R"({"dof": 5})"}});
  store.set_contenders({{"ode-quick", "ode", "0.16.2", "ode-quick", "iterations=20", "{}", "{}"}});
  store.set_conformance("ode-quick", {{"", "free-fall", "pass", 1e-6, 1e-5, "m", "note"}});
  store.set_runs({{"abc", "chain", "ode-quick", 1}});
  store.set_scenes({{"chain", "{\"bodies\": []}"}});
  store.set_node({"0123456789abcdef", R"({"name": "one", "shard": "1/1"})"});
  std::vector<PlanRow> plan;
  for (int i = 0; i <= cells; ++i) plan.push_back({numbered_cell(i).key, 1 + i % 2, 0.25 * i, i % 3 == 0});
  store.set_plan(plan);
  for (int i = 0; i < cells; ++i) store.put_cell(numbered_cell(i), numbered_samples(i, samples));
  store.set_derived({"truth_order"}, {{1, {"truth_order", "1", 1.0, {}, {}}}});
}

inline void change(const std::string& dir, const std::string& sql) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((dir + "/assay.sqlite").c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
}

inline std::string asked(const std::string& dir, const std::string& sql) {
  sqlite3* db = nullptr;
  sqlite3_open((dir + "/assay.sqlite").c_str(), &db);
  sqlite3_stmt* query = nullptr;
  std::string text;
  sqlite3_prepare_v2(db, sql.c_str(), -1, &query, nullptr);
  while (sqlite3_step(query) == SQLITE_ROW) {
    text += reinterpret_cast<const char*>(sqlite3_column_text(query, 0));
    text += ";";
  }
  sqlite3_finalize(query);
  sqlite3_close(db);
  return text;
}

class StoreFaultsTest : public TempFolderTest {
 protected:
  std::string dir(const std::string& name = "results") const { return (dir_ / name).string(); }
};

}  // namespace assay
