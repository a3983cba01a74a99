// `assay check DIR`: which files are robots, which findings a baseline knows, and what is written for other programs.
#include "check/dataset/dataset.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/json.h"
#include "check/dataset/baseline.h"
#include "check/dataset/examine.h"
#include "check/dataset/files.h"
#include "check/dataset/junit.h"
#include "check/dataset/sarif.h"
#include "message_of.h"
#include "temp_folder.h"

namespace assay::dataset {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::Pair;

// ---- files -----------------------------------------------------------------------------------------------------------

class DatasetFiles : public TempFolderTest {
 protected:
  void write(const std::string& name) {
    fs::create_directories((dir_ / name).parent_path());
    std::ofstream(dir_ / name) << "x";
  }
};

TEST_F(DatasetFiles, AreSortedWithoutHiddenOnes) {
  for (const char* name : {"b.urdf", "a/z.xml", "a/B.MJCF", "a.b/c.xml", ".git/c.urdf", "a/.d.urdf", "mesh.stl",
                           "a/e.urdf.xacro", "a/world.usd", "a/d.sdf", "f.XACRO"}) {
    write(name);
  }
  const Listing listing = list_files(dir_.string());
  EXPECT_THAT(listing.files, ElementsAre("a.b/c.xml", "a/B.MJCF", "a/d.sdf", "a/z.xml", "b.urdf"));
  EXPECT_THAT(listing.others, ElementsAre(Pair(".usd", 1), Pair(".xacro", 2)));
  EXPECT_THAT(listing.unreadable, IsEmpty());
  EXPECT_EQ(listing.links_out, 0U);
}

TEST_F(DatasetFiles, LinksLeadNowhereElse) {
  write("outside/robot.urdf");
  write("robots/arm/arm.urdf");
  write("robots/blob");
  fs::create_symlink(dir_ / "outside", dir_ / "robots/other");
  fs::create_symlink(dir_ / "outside/robot.urdf", dir_ / "robots/robot.urdf");
  fs::create_symlink("gone.urdf", dir_ / "robots/broken.urdf");
  fs::create_symlink(".", dir_ / "robots/again");                   // a circle
  fs::create_symlink("arm/arm.urdf", dir_ / "robots/latest.urdf");  // found itself
  fs::create_symlink("blob", dir_ / "robots/annexed.urdf");         // found by this name alone
  const Listing listing = list_files((dir_ / "robots").string());
  EXPECT_THAT(listing.files, ElementsAre("annexed.urdf", "arm/arm.urdf"));
  EXPECT_EQ(listing.links_out, 3U);
}

TEST_F(DatasetFiles, AFolderThatIsNotThereIsRefused) {
  EXPECT_THAT(message_of([&] { list_files((dir_ / "none").string()); }), HasSubstr("none"));
}

TEST(DatasetParts, AreWhatOthersInclude) {
  using Includes = std::map<std::string, std::set<std::string>>;
  EXPECT_THAT(included_parts(Includes{{"scene.xml", {"arm.xml", "hand.xml"}}, {"arm.xml", {"hand.xml"}}}),
              ElementsAre(Pair("arm.xml", "scene.xml"), Pair("hand.xml", "arm.xml")));
  // wrong files are robots still: a check of nothing would say nothing
  EXPECT_THAT(included_parts(Includes{{"a.xml", {"b.xml", "a.xml"}}, {"b.xml", {"a.xml", "b.xml"}}}), IsEmpty());
  EXPECT_THAT(included_parts(Includes{{"a.xml", {"a.xml"}}}), IsEmpty());
}

// ---- reports ---------------------------------------------------------------------------------------------------------

Record record(Rank rank, const std::string& kind, const std::string& element, int line = 0) {
  return {.rank = rank,
          .kind = kind,
          .element = element,
          .line = line,
          .message = kind + ": " + element,
          .subject = element};
}

FileReport report_of(const std::string& file, std::vector<Record> records) {
  std::ranges::stable_sort(records, {}, &Record::rank);
  return {.path = file, .file = file, .records = std::move(records)};
}

std::vector<bool> known_of(const FileReport& report) {
  std::vector<bool> known;
  known.reserve(report.records.size());
  for (const Record& each : report.records) known.push_back(each.known);
  return known;
}

TEST(DatasetReport, FailsFromALevelOn) {
  Report report;
  report.files = {report_of("a", {record(Rank::kMend, "start-overlap", "x"), record(Rank::kKnow, "mesh-open", "y")})};
  EXPECT_EQ(report.failing(), 0U);  // refused files alone
  report.fail_on = Rank::kMend;
  EXPECT_EQ(report.failing(), 1U);
  report.fail_on = Rank::kKnow;
  EXPECT_EQ(report.failing(), 2U);
  report.files[0].records[0].known = true;
  EXPECT_EQ(report.failing(), 1U);
  report.fail_on = std::nullopt;
  EXPECT_EQ(report.failing(), 0U);
  EXPECT_STREQ(report.files[0].verdict(), "mend");
}

TEST(DatasetReport, NamesOfRanks) {
  for (const Rank rank : kRanks) EXPECT_EQ(rank_named(rank_text(rank)), rank);
  EXPECT_EQ(rank_named("error"), std::nullopt);
}

TEST(DatasetReport, KindsAreCountedByFile) {
  Report report;
  report.titles = {{"mesh-open", "meshes that are not closed"}};
  report.files = {report_of("a", {record(Rank::kKnow, "mesh-open", "x"), record(Rank::kKnow, "mesh-open", "y")}),
                  report_of("b", {record(Rank::kKnow, "mesh-open", "x"), record(Rank::kRefused, "refused", "z")})};
  report.files[1].records[1].known = true;
  const std::vector<KindCount> kinds = report.kinds();
  ASSERT_EQ(kinds.size(), 2U);
  EXPECT_EQ(kinds[0].kind, "refused");
  EXPECT_EQ(kinds[1].title, "meshes that are not closed");
  EXPECT_EQ(kinds[1].findings, 3U);
  EXPECT_EQ(kinds[1].files, 2U);
  EXPECT_EQ(kinds[1].fresh, 2U);
}

TEST(DatasetReport, AMessageIsTheSameInOtherPlaces) {
  EXPECT_EQ(without_places("it ends in line 12, not in line 3", "robots"), "it ends in line, not in line");
  EXPECT_EQ(without_places("names 'robots/arm/a.stl'", "robots"), "names 'arm/a.stl'");
  EXPECT_EQ(without_places("an outline is missing", "robots"), "an outline is missing");
}

TEST(DatasetReport, WhatIsNoReportIsRefused) {
  std::map<std::string, std::string> titles;
  for (const char* text :
       {"", "{}", "[1]", R"({"model": 3, "records": [], "notes": [], "repairs": [], "repaired": ""})",
        R"({"model": null, "records": [{"rank": "bad"}], "notes": [], "repairs": [], "repaired": ""})"}) {
    EXPECT_THROW(read_examination(text, "a.urdf", titles), std::exception) << text;
  }
  EXPECT_EQ(read_survey("no survey").kind, Survey::Kind::kRobot);
}

// ---- baseline --------------------------------------------------------------------------------------------------------

Baseline baseline_of(const std::vector<FileReport>& files) {
  return Baseline::parse(baseline_text(files), "known.json");
}

TEST(DatasetBaseline, KnowsFindingsByFileKindAndSubject) {
  const FileReport before = report_of("a.urdf", {record(Rank::kMend, "start-overlap", "geoms 'a' and 'b'", 10),
                                                 record(Rank::kKnow, "mesh-open", "mesh 'arm'", 20)});
  FileReport after = report_of("a.urdf", {record(Rank::kMend, "start-overlap", "geoms 'a' and 'b'", 99),
                                          record(Rank::kMend, "start-overlap", "geoms 'a' and 'c'", 10),
                                          record(Rank::kKnow, "mesh-huge", "mesh 'arm'", 20),
                                          record(Rank::kKnow, "mesh-open", "mesh 'arm'", 21)});
  Baseline baseline = baseline_of({before});
  baseline.mark(after);
  EXPECT_THAT(known_of(after), ElementsAre(true, false, false, true));
  EXPECT_THAT(baseline.left(), IsEmpty());
  EXPECT_TRUE(baseline.is_of_this_folder());

  FileReport elsewhere = report_of("b.urdf", {record(Rank::kKnow, "mesh-open", "mesh 'arm'", 20)});
  Baseline again = baseline_of({before});
  again.mark(elsewhere);
  EXPECT_THAT(known_of(elsewhere), ElementsAre(false));
  EXPECT_FALSE(again.is_of_this_folder());
  EXPECT_EQ(again.left().size(), 2U);
}

TEST(DatasetBaseline, CountsWhatIsAlike) {
  const Record open = record(Rank::kKnow, "mesh-open", "mesh 'arm'");
  Baseline baseline = baseline_of({report_of("a", {open, open})});
  FileReport more = report_of("a", {open, open, open});
  baseline.mark(more);
  EXPECT_THAT(known_of(more), ElementsAre(true, true, false));

  Baseline fewer = baseline_of({report_of("a", {open, open})});
  FileReport one = report_of("a", {open});
  fewer.mark(one);
  const std::vector<Known> gone = fewer.left();
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].subject, "mesh 'arm'");
  EXPECT_EQ(gone[0].count, 1U);
}

TEST(DatasetBaseline, WhatHasBecomeWorseIsNew) {
  const auto overlap = [](Rank rank) { return report_of("a", {record(rank, "start-overlap", "geoms 'a' and 'b'")}); };
  Baseline was_small = baseline_of({overlap(Rank::kKnow)});
  FileReport worse = overlap(Rank::kMend);
  was_small.mark(worse);
  EXPECT_THAT(known_of(worse), ElementsAre(false));
  Baseline was_large = baseline_of({overlap(Rank::kMend)});
  FileReport better = overlap(Rank::kKnow);
  was_large.mark(better);
  EXPECT_THAT(known_of(better), ElementsAre(true));
  EXPECT_THAT(was_large.left(), IsEmpty());

  // the one that is to mend takes the one that was
  Baseline both = baseline_of({report_of("a", {record(Rank::kMend, "k", "x"), record(Rank::kKnow, "k", "x")})});
  FileReport same = report_of("a", {record(Rank::kKnow, "k", "x"), record(Rank::kMend, "k", "x")});
  both.mark(same);
  EXPECT_THAT(known_of(same), ElementsAre(true, true));
}

TEST(DatasetBaseline, ItsTextDependsOnFindingsAlone) {
  const FileReport a = report_of("a", {record(Rank::kKnow, "k", "x", 1), record(Rank::kKnow, "k", "y", 2)}),
                   b = report_of("b", {record(Rank::kKnow, "k", "x", 3)});
  const FileReport moved = report_of("a", {record(Rank::kKnow, "k", "y", 7), record(Rank::kKnow, "k", "x", 9)});
  EXPECT_EQ(baseline_text({a, b}), baseline_text({b, moved}));
  EXPECT_THAT(baseline_text({a, b}),
              HasSubstr("\n    {\"file\":\"a\",\"level\":\"know\",\"kind\":\"k\",\"subject\":\"x\"},\n"));
  EXPECT_TRUE(baseline_of({}).is_of_this_folder());
}

TEST(DatasetBaseline, WhatIsNoneIsRefusedInASentence) {
  const auto refusal = [](const std::string& text) { return message_of([&] { Baseline::parse(text, "known.json"); }); };
  for (const char* text :
       {"", "no JSON", "[]", "{}", R"({"format": "something else"})", R"({"format": "assay check baseline"})",
        R"({"format": "assay check baseline", "version": 1})",
        R"({"format": "assay check baseline", "version": 1, "findings": [3]})",
        R"({"format": "assay check baseline", "version": 1, "findings": [{"file": "a"}]})"}) {
    EXPECT_THAT(refusal(text), HasSubstr("--baseline 'known.json'")) << text;
    EXPECT_THAT(refusal(text), HasSubstr("--write-baseline")) << text;
  }
  EXPECT_THAT(refusal(R"({"format": "assay check baseline", "version": 2, "findings": []})"),
              HasSubstr("version 2 of the format, and this assay reads version 1"));
  EXPECT_THAT(refusal(R"({"format": "assay check baseline", "version": 1, "findings": [
                        {"file": "a", "level": "bad", "kind": "k", "subject": "s"}]})"),
              HasSubstr("level 'bad'"));
  EXPECT_THAT(refusal(R"({"format": "assay check baseline", "version": 1, "findings": [
                        {"file": "a", "level": "mend", "kind": "k", "subject": "s", "count": 0}]})"),
              HasSubstr("'count'"));
}

// ---- for other programs ----------------------------------------------------------------------------------------------

Report three_levels() {
  Report report;
  report.folder = "robots";
  report.titles = {{"refused", "the file is refused"}, {"start-overlap", "overlap"}, {"mesh-open", "open"}};
  Record in_part = record(Rank::kKnow, "mesh-open", "mesh 'arm'", 7);
  in_part.file = "arm/part.xml";
  report.files = {report_of("a b.urdf", {record(Rank::kRefused, "refused", "", 0)}),
                  report_of("arm/arm.xml", {in_part, record(Rank::kMend, "start-overlap", "geoms 'a' and 'b'", 3),
                                            record(Rank::kMend, "start-overlap", "geoms 'a' and 'b'", 4)}),
                  report_of("fine.urdf", {})};
  return report;
}

TEST(DatasetSarif, HasWhatItsSchemaRequires) {
  const Json sarif = sarif_json(three_levels());
  EXPECT_EQ(sarif.at("version"), "2.1.0");
  ASSERT_EQ(sarif.at("runs").size(), 1U);
  const Json& run = sarif.at("runs")[0];
  const Json& driver = run.at("tool").at("driver");
  EXPECT_EQ(driver.at("name"), "assay");
  const Json& rules = driver.at("rules");
  ASSERT_EQ(rules.size(), 3U);
  const Json& results = run.at("results");
  ASSERT_EQ(results.size(), 4U);
  std::set<std::string> fingerprints;
  for (const Json& result : results) {
    EXPECT_EQ(rules.at(result.at("ruleIndex").get<size_t>()).at("id"), result.at("ruleId"));
    EXPECT_FALSE(result.at("message").at("text").get<std::string>().empty());
    EXPECT_FALSE(result.contains("baselineState"));
    fingerprints.insert(result.at("partialFingerprints").begin()->get<std::string>());
  }
  EXPECT_EQ(fingerprints.size(), 4U);
  const auto location = [&](size_t i) { return results[i].at("locations")[0].at("physicalLocation"); };
  EXPECT_EQ(results[0].at("level"), "error");
  EXPECT_EQ(location(0).at("artifactLocation").at("uri"), "a%20b.urdf");
  EXPECT_FALSE(location(0).contains("region"));  // no line is known
  EXPECT_EQ(results[1].at("level"), "warning");
  EXPECT_EQ(location(1).at("region").at("startLine"), 3);
  EXPECT_EQ(results[3].at("level"), "note");
  EXPECT_EQ(location(3).at("artifactLocation").at("uri"), "arm/part.xml");
}

TEST(DatasetSarif, AFingerprintDoesNotDependOnLines) {
  Report moved = three_levels();
  for (FileReport& file : moved.files) {
    for (Record& each : file.records) each.line += 100;
  }
  const auto fingerprints = [](const Report& report) {
    std::vector<Json> found;
    const Json sarif = sarif_json(report);
    for (const Json& result : sarif.at("runs")[0].at("results")) found.push_back(result.at("partialFingerprints"));
    return found;
  };
  EXPECT_EQ(fingerprints(three_levels()), fingerprints(moved));
}

TEST(DatasetSarif, SaysWhatTheBaselineHas) {
  Report report = three_levels();
  report.has_baseline = true;
  report.files[0].records[0].known = true;
  const Json sarif = sarif_json(report);
  const Json& results = sarif.at("runs")[0].at("results");
  EXPECT_EQ(results[0].at("baselineState"), "unchanged");
  EXPECT_EQ(results[1].at("baselineState"), "new");
}

TEST(DatasetSarif, UrisHaveNoBytesOfTheirOwn) {
  EXPECT_EQ(uri_of("a/b-1_2.~.urdf"), "a/b-1_2.~.urdf");
  EXPECT_EQ(uri_of("caf\xe9 #1%.urdf"), "caf%E9%20%231%25.urdf");
}

TEST(DatasetJunit, HasATestForEachFile) {
  Report report = three_levels();
  report.files[0].records[0].message = "link '\x1b[31m<b>' is refused";
  const std::string text = junit_text(report);
  EXPECT_THAT(text, HasSubstr(R"(name="assay check robots" tests="3" failures="1" errors="0")"));
  EXPECT_THAT(text, HasSubstr(R"(classname="." name="a b.urdf")"));
  EXPECT_THAT(text, HasSubstr(R"(classname="arm" name="arm.xml")"));
  EXPECT_THAT(text, HasSubstr("\\x1b[31m&lt;b&gt;"));
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
  EXPECT_THAT(text, Not(HasSubstr("start-overlap")));  // it does not fail
  report.fail_on = Rank::kMend;
  EXPECT_THAT(junit_text(report), HasSubstr("arm/arm.xml:3: mend (start-overlap)"));
  report.files[2].records = {record(Rank::kRefused, kinds::kTimeLimit, "")};
  EXPECT_THAT(junit_text(report), HasSubstr(R"(failures="2" errors="1")"));
}

TEST(DatasetJson, KeepsWhatIsNotKnownAsNull) {
  const Json json = report_json(three_levels());
  EXPECT_EQ(json.at("failing"), 1);
  EXPECT_TRUE(json.at("baseline").is_null());
  const Json& finding = json.at("files")[0].at("findings")[0];
  for (const char* key : {"element", "line", "file"}) EXPECT_TRUE(finding.at(key).is_null()) << key;
  EXPECT_EQ(json.at("files")[2].at("verdict"), "ok");
}

}  // namespace
}  // namespace assay::dataset
