#include "report/report.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "results/store/store.h"

namespace assay {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string page_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class ReportTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = testing::TempDir() + "assay-report-" + info->name() + "-" + std::to_string(getpid());
    std::filesystem::remove_all(dir_);
  }
  void TearDown() override {
    std::filesystem::permissions(dir_, std::filesystem::perms::owner_all, ignored_);
    std::filesystem::remove_all(dir_, ignored_);
  }

  Store make() {
    Store store = Store::create(dir_, {"test", "1234"});
    store.set_manifest({{"cpu", "Example"}});
    store.set_systems({{"chain", R"({"dof": 5, "bodies": 5})"}});
    store.set_contenders({{"b-first", "bee", "2.0", "b-first", "k=1", R"({"order": 4})", R"({"compiler": "g++"})"},
                          {"a-second", "ay", "1.0", "a-second", "", "", "not json"}});
    store.set_conformance("a-second", {{"a-second", "free-fall", "fail", 0.5, 0.25, "m", "falls up"}});
    Cell good;
    good.key = "1";
    good.system = "chain";
    good.contender = "a-second";
    good.timestep_ms = 0.25;
    good.measure = "truth";
    good.wall_s = 2;
    good.cpu_s = 1.5;
    good.engine_s = 1.25;
    good.steal = 0.125;
    good.values = {{"truth_error", "m", 0.1, 0.0625, 0.5}, {"truth_order", "1", std::nullopt, {}, {}}};
    store.put_cell(good);
    Cell bad = good;
    bad.key = "2";
    bad.contender = "b-first";
    bad.outcome = Outcome::kCrashed;
    bad.reason = "said </script><!-- \xe2\x80\xa8\xe2\x80\xa9 \xff \"quoted\" \\";
    bad.values.clear();
    store.put_cell(bad);
    return store;
  }

  std::string dir_;
  std::error_code ignored_;
};

TEST_F(ReportTest, HoldsWhatTheStoreHolds) {
  const Store store = make();
  const json data = report_data(store);
  EXPECT_EQ(data["format"], 4);
  EXPECT_THAT(data["manifest"].dump(), HasSubstr(R"({"key":"cpu","value":"Example"})"));
  ASSERT_EQ(data["systems"].size(), 1);
  EXPECT_EQ(data["systems"][0]["name"], "chain");
  EXPECT_EQ(data["systems"][0]["facts"]["dof"], 5);
  EXPECT_EQ(data["systems"][0]["section"], true);
  EXPECT_EQ(data["systems"][0]["size"], false);
  EXPECT_EQ(data["measured"], (json{{"cells", 2}, {"ok", 1}, {"contenders", {"a-second", "b-first"}}}));

  // As listed, not by name.
  ASSERT_EQ(data["contenders"].size(), 2);
  EXPECT_EQ(data["contenders"][0]["name"], "b-first");
  EXPECT_EQ(data["contenders"][0]["settings"], "k=1");
  EXPECT_EQ(data["contenders"][0]["capabilities"]["order"], 4);
  EXPECT_EQ(data["contenders"][0]["build"]["compiler"], "g++");
  // What cannot be read is empty, so that the page still comes up.
  EXPECT_EQ(data["contenders"][1]["capabilities"], json::object());
  EXPECT_EQ(data["contenders"][1]["build"], json::object());

  ASSERT_EQ(data["conformance"].size(), 1);
  EXPECT_EQ(data["conformance"][0], (json{{"contender", "a-second"},
                                          {"test", "free-fall"},
                                          {"status", "fail"},
                                          {"figure", 0.5},
                                          {"tolerance", 0.25},
                                          {"unit", "m"},
                                          {"note", "falls up"}}));

  ASSERT_EQ(data["cells"].size(), 2);
  EXPECT_EQ(data["cells"][0]["contender"], "b-first");
  EXPECT_EQ(data["cells"][0]["outcome"], "crashed");
  EXPECT_EQ(data["cells"][0]["values"], json::array());
  const json& good = data["cells"][1];
  EXPECT_EQ(good["outcome"], "ok");
  EXPECT_EQ(good["timestep_ms"], 0.25);
  EXPECT_EQ(good["wall_s"], 2);
  EXPECT_EQ(good["cpu_s"], 1.5);
  EXPECT_EQ(good["engine_s"], 1.25);
  EXPECT_EQ(good["steal"], 0.125);
  ASSERT_EQ(good["values"].size(), 2);
  EXPECT_EQ(good["values"][0], (json{{"name", "truth_error"}, {"value", 0.1}, {"low", 0.0625}, {"high", 0.5}}));
  EXPECT_TRUE(good["values"][1]["value"].is_null());
  EXPECT_FALSE(good["values"][1].contains("low"));
}

TEST_F(ReportTest, EmptyResultsGiveAPage) {
  {
    const Store store = Store::create(dir_, {"test", "1234"});
  }
  write_report(dir_, dir_ + "/report.html");
  const std::string page = page_of(dir_ + "/report.html");
  EXPECT_THAT(page, HasSubstr("<!doctype html>"));
  EXPECT_THAT(page, HasSubstr(R"("measured":{"cells":0,"contenders":[],"ok":0})"));
  EXPECT_THAT(page, Not(HasSubstr("data-cells=\"0\"")));
  EXPECT_TRUE(page.ends_with("</html>\n"));
}

// Content of the element that begins with `open`.
std::string element(const std::string& page, const std::string& open) {
  const size_t begin = page.find(open);
  if (begin == std::string::npos) return "no such element";
  const size_t from = begin + open.size();
  return page.substr(from, page.find("</script>", from) - from);
}

TEST_F(ReportTest, DataCannotLeaveItsElement) {
  const Store store = make();
  const std::string page = report_html(report_data(store));
  for (const std::string name : {R"(id="assay-data")", R"(data-cells="0")"}) {
    const std::string inside = element(page, fmt::format(R"(<script type="application/json" {}>)", name));
    EXPECT_TRUE(json::accept(inside)) << inside;
    EXPECT_THAT(inside, Not(HasSubstr("<")));
    EXPECT_THAT(inside, Not(HasSubstr("\xe2\x80\xa8")));
    EXPECT_THAT(inside, Not(HasSubstr("\xe2\x80\xa9")));
    EXPECT_THAT(inside, Not(HasSubstr("/*DATA*/")));
  }
  // A parser gets the text back; the byte that is no UTF-8 is replaced.
  const json cells = json::parse(element(page, R"(<script type="application/json" data-cells="0">)"));
  EXPECT_EQ(cells[0]["reason"], "said </script><!-- \xe2\x80\xa8\xe2\x80\xa9 \xef\xbf\xbd \"quoted\" \\");
  EXPECT_EQ(cells[1], report_data(store)["cells"][1]);
}

TEST_F(ReportTest, CellsOfTheFirstSectionComeBeforeThePagesScript) {
  Store store = Store::create(dir_, {"test", "1234"});
  store.set_systems({{"falls", "{}"}, {"robot", R"({"control": "torques of 3 actuators"})"}});
  for (const std::string system : {"falls", "robot", "unknown"}) {
    Cell cell;
    cell.key = cell.system = system;
    cell.contender = "some-engine";
    cell.timestep_ms = 1;
    cell.measure = "consistency";
    store.put_cell(cell);
  }
  const json data = report_data(store);
  std::vector<std::string> order;
  for (const json& system : data["systems"]) order.push_back(system["name"]);
  EXPECT_THAT(order, testing::ElementsAre("robot", "falls", "unknown"));
  EXPECT_EQ(data["contenders"][0]["engine"], "some");
  const std::string page = report_html(data);
  const size_t script = page.find("<script>");
  EXPECT_LT(page.find("data-cells=\"0\""), script);
  EXPECT_GT(page.find("data-cells=\"1\""), script);
  EXPECT_THAT(element(page, R"(<script type="application/json" data-cells="0">)"), HasSubstr("\"robot\""));
  EXPECT_THAT(element(page, R"(<script type="application/json" data-cells="2">)"), HasSubstr("\"unknown\""));
}

TEST_F(ReportTest, PageNeedsNothingFromOutside) {
  const std::string page = report_html(json::object());
  for (const std::string what : {"src=\"", "@import", "fetch(", "XMLHttpRequest", "https://", "url(http"}) {
    EXPECT_THAT(page, Not(HasSubstr(what)));
  }
}

TEST_F(ReportTest, SameDatabaseSameBytes) {
  {
    const Store store = make();
  }
  write_report(dir_, dir_ + "/one.html");
  write_report(dir_, dir_ + "/two.html");
  const std::string one = page_of(dir_ + "/one.html");
  EXPECT_GT(one.size(), 10000);
  EXPECT_EQ(one, page_of(dir_ + "/two.html"));
}

TEST_F(ReportTest, NoResultsIsTheUsersFault) {
  EXPECT_THROW(write_report(dir_, dir_ + ".html"), InputError);
  EXPECT_FALSE(std::filesystem::exists(dir_ + ".html"));
}

TEST_F(ReportTest, ShowsWhatFitsAndNamesTheRest) {
  Store store = Store::create(dir_, {"test", "1234"});
  std::vector<SystemRow> systems;
  systems.reserve(8);
  for (int s = 0; s < 8; ++s) systems.push_back({fmt::format("system-{}", s), "{}"});
  store.set_systems(systems);
  for (int i = 0; i < 8 * 50; ++i) {
    Cell cell;
    cell.key = std::to_string(i);
    cell.system = systems[static_cast<size_t>(i / 50)].name;
    cell.contender = fmt::format("contender-{}", i % 50);
    cell.timestep_ms = 1;
    cell.measure = "consistency";
    cell.values = {{"consistency", "m", 0.1234567890123, {}, {}}};
    // what the page has to escape takes more room than its JSON
    if (i < 50) cell.outcome = Outcome::kUnstable, cell.reason = std::string(20, '<');
    store.put_cell(cell, {{"piece_error_m", std::vector<double>(20, 0.123456)}});
  }
  const json all = report_data(store);
  EXPECT_EQ(all["cells"][0]["values"][0]["value"], 0.1234567890123);
  EXPECT_EQ(all["systems"].size(), 8U);
  EXPECT_FALSE(all["cells"][0]["samples"].empty());
  EXPECT_THAT(all["manifest"].dump(), Not(HasSubstr("left_out")));

  const size_t whole = report_html(all).size();
  size_t samples = 0;
  for (const json& cell : all["cells"]) samples += cell["samples"].dump().size();
  const json shorter = report_data(store, {.most_bytes = whole - 1000});
  EXPECT_EQ(shorter["cells"][0]["values"][0]["value"], 0.123457) << "digits that the page does not show go first";
  EXPECT_FALSE(shorter["cells"][0]["samples"].empty());
  EXPECT_THAT(shorter["manifest"].dump(), Not(HasSubstr("left_out")));
  EXPECT_LE(report_html(shorter).size(), whole - 1000);
  const json without = report_data(store, {.most_bytes = whole - samples / 2});
  EXPECT_EQ(without["systems"].size(), 8U) << "then the samples' distributions";
  EXPECT_TRUE(without["cells"][0]["samples"].empty());

  const size_t most =
      whole - samples - (whole - samples - report_html(report_data(store, {.most_bytes = 0})).size()) / 2;
  const json some = report_data(store, {.most_bytes = most});
  EXPECT_LT(some["systems"].size(), 8U);
  EXPECT_GT(some["systems"].size(), 1U);
  EXPECT_EQ(some["views"].size(), some["systems"].size());
  EXPECT_LE(report_html(some).size(), most);
  const json more = {{"changes", {{"note", std::string(1000, '<')}}}};
  write_report(dir_, dir_ + "/small.html", more, {.most_bytes = most});
  EXPECT_LE(std::filesystem::file_size(dir_ + "/small.html"), most);
  EXPECT_THAT(some["manifest"].dump(), AllOf(HasSubstr("left_out"), HasSubstr("system-7")));
  EXPECT_THAT(write_report(dir_, dir_ + "/least.html", json::object(), {.most_bytes = 1000}),
              HasSubstr("MB all the same"))
      << "one system is always shown";

  const json chosen = report_data(store, {.systems = {"system-7"}, .most_bytes = most});
  EXPECT_EQ(chosen["cells"].size(), 50U);
  EXPECT_EQ(chosen["systems"][0]["name"], "system-7");
  EXPECT_THROW(report_data(store, {.systems = {"system-8"}}), InputError);
}

TEST_F(ReportTest, AFailedWriteLeavesTheOldReport) {
  {
    const Store store = make();
  }
  EXPECT_THROW(write_report(dir_, dir_ + "/missing/report.html"), SystemError);
  // What cannot be replaced stays, and no part of a new file does.
  std::filesystem::create_directory(dir_ + "/report.html");
  EXPECT_THROW(write_report(dir_, dir_ + "/report.html"), SystemError);
  EXPECT_TRUE(std::filesystem::is_directory(dir_ + "/report.html"));
  for (const auto& entry : std::filesystem::directory_iterator(dir_)) {
    EXPECT_THAT(entry.path().string(), Not(HasSubstr(".part")));
  }
}

}  // namespace
}  // namespace assay
