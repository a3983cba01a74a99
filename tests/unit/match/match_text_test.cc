#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "load/mjcf.h"
#include "match/match.h"
#include "temp_folder.h"

namespace assay::match {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kHinge = R"(<mujoco model="arm"><worldbody>
  <body name="arm"><joint name="hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.3"/></body></worldbody></mujoco>)";

using AtRest = TempFolderTest;

// The mean square of a sine's distance from its first value is that of the values themselves where it begins at 0.
TEST_F(AtRest, IsTheErrorOfWhatStaysAtTheFirstSample) {
  std::filesystem::create_directories(dir_);
  const std::string path = (dir_ / "swing.csv").string();
  std::string text = "time,hinge,hinge.torque\n";
  for (int i = 0; i <= 2000; ++i) {
    const double t = i / 200.0;
    text += fmt::format("{:.4f},{:.9f},{:.9f}\n", t, 0.5 * std::sin(2 * std::numbers::pi * t), std::sin(3 * t));
  }
  std::ofstream(path) << text;
  const Model model = load_model_text(kHinge, "arm");
  const MatchConfig config;
  const std::vector<MeasuredLog> logs = read_logs({path}, model, config);
  const Windows windows(model, logs, config, LogCheck());
  const Window& window = windows.all()[windows.of(WindowUse::kReport, {true}).front()];
  double squares = 0;
  for (const double q : window.measured) squares += std::pow(q - window.measured.front(), 2);
  const double expected = 180 / std::numbers::pi * std::sqrt(squares / static_cast<double>(window.measured.size()));
  EXPECT_NEAR(windows.error_at_rest(window).joints, expected, 1e-9);
  EXPECT_GT(expected, 10);
}

// What is no better than a robot that does not move explains nothing, however it ranks.
TEST(MatchText, AFitThatIsNoBetterThanRestDoesNotMoveAsTheRobotDid) {
  MatchQuestion question;
  MatchAnswer answer;
  answer.contenders.resize(1);
  ContenderResult& best = answer.contenders.front();
  best.contender = "dart";
  best.score.value = 73.2, best.untuned_score.value = 73.5;
  LogResult log;
  log.fitted.joints_deg = 73.2, log.untuned.joints_deg = 73.5, log.floor.joints_deg = 0.9, log.at_rest.joints_deg = 60;
  best.logs = {log};
  EXPECT_TRUE(best.no_better_than_rest());
  EXPECT_THAT(answer_text(question, answer),
              AllOf(HasSubstr("No contender moves as the robot did: the nearest, dart, is off by 73.2 deg over 2 s"),
                    HasSubstr("what stays where it starts is off by 60 deg")));
  best.logs.front().at_rest.joints_deg = 80;
  EXPECT_FALSE(best.no_better_than_rest());
  EXPECT_THAT(answer_text(question, answer),
              AllOf(HasSubstr("dart moves as the robot did within 73.2 deg over 2 s"), Not(HasSubstr("No contender"))));
}

}  // namespace
}  // namespace assay::match
