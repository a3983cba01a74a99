// Machines that measured, and the plan of what is to be measured.
#include <cerrno>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "results/store/cell_hash.h"
#include "results/store/database.h"
#include "results/store/store.h"

namespace assay {

using sql::execute;
using sql::Statement;
using sql::Transaction;

std::vector<NodeRow> Store::nodes() const {
  std::vector<NodeRow> rows;
  if (!sql::has_table(db_.get(), "nodes")) return rows;
  const sql::Snapshot snapshot(db_.get());
  verify("nodes");
  Statement query(db_.get(), "SELECT id, json FROM nodes ORDER BY id");
  while (query.step()) rows.push_back({query.text(0), query.text(1)});
  return rows;
}

std::vector<PlanRow> Store::plan() const {
  std::vector<PlanRow> rows;
  if (!sql::has_table(db_.get(), "plan")) return rows;
  const sql::Snapshot snapshot(db_.get());
  verify("plan");
  Statement query(db_.get(), "SELECT key, shard, cost_s, accuracy FROM plan ORDER BY key");
  while (query.step()) {
    rows.push_back({query.text(0), static_cast<int>(query.integer(1)), query.number(2), query.integer(3) != 0});
  }
  return rows;
}

std::map<std::string, Store::Spent> Store::spent() const {
  std::map<std::string, Spent> spent;
  Statement query(db_.get(), "SELECT measure, sum(wall_s), sum(cpu_s), sum(engine_s) FROM cells GROUP BY measure");
  while (query.step()) spent[query.text(0)] = {query.number(1), query.number(2), query.number(3)};
  return spent;
}

std::vector<Store::PartDone> Store::plan_done() const {
  std::vector<PartDone> parts;
  if (!sql::has_table(db_.get(), "plan")) return parts;
  const sql::Snapshot snapshot(db_.get());
  verify("plan");
  Statement query(db_.get(),
                  "SELECT p.shard, p.accuracy, count(*), count(c.id), sum(p.cost_s), "
                  "total(CASE WHEN c.id IS NULL THEN 0 ELSE p.cost_s END), total(c.wall_s) "
                  "FROM plan p LEFT JOIN cells c ON c.key = p.key GROUP BY 1, 2 ORDER BY 1, 2 DESC");
  while (query.step()) {
    parts.push_back({static_cast<int>(query.integer(0)), query.integer(1) != 0, static_cast<size_t>(query.integer(2)),
                     static_cast<size_t>(query.integer(3)), query.number(4), query.number(5), query.number(6)});
  }
  return parts;
}

bool Store::is_written(const std::string& dir) {
  const int lock = ::open((dir + "/.lock").c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (lock < 0) return false;
  const bool held = ::flock(lock, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(lock);  // gives the lock back
  return held;
}

void Store::set_node(const NodeRow& row) {
  Transaction transaction(db_.get());
  verify("nodes");
  Statement(db_.get(), "INSERT OR REPLACE INTO nodes VALUES(?, ?)").bind_all(row.id, row.json).run();
  sql::put_table_hash(db_.get(), "nodes");
  transaction.commit();
  node_ = row.id;
}

void Store::set_plan(const std::vector<PlanRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM plan");
  Statement put(db_.get(), "INSERT OR REPLACE INTO plan VALUES(?, ?, ?, ?)");
  for (const PlanRow& row : rows) {
    put.bind_all(row.key, std::int64_t{row.shard}, std::optional(row.cost_s), std::int64_t{row.accuracy ? 1 : 0}).run();
  }
  sql::put_table_hash(db_.get(), "plan");
  transaction.commit();
}

}  // namespace assay
