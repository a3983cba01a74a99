#include "match/log.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "load/mjcf.h"
#include "match/log_table.h"
#include "message_of.h"
#include "temp_folder.h"

namespace assay::match {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kArm = R"(<mujoco model="arm"><worldbody>
  <body name="upper"><joint name="shoulder" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.3"/>
    <body name="lower" pos="0 0 -0.5"><joint name="slider" type="slide" axis="0 0 1"/><geom size="0.1"/></body>
  </body></worldbody></mujoco>)";
constexpr const char* kBox = R"(<mujoco model="box"><worldbody><body name="cube"><freejoint/>
  <inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/><geom type="box" size="0.1 0.1 0.1"/></body></worldbody></mujoco>)";

class LogFiles : public TempFolderTest {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories(dir_);
    std::ofstream(dir_ / name, std::ios::binary) << text;
    return (dir_ / name).string();
  }
  MatchConfig config(const std::string& text) { return parse_match_config(text, "match.toml"); }
  Model arm_ = load_model_text(kArm, "arm"), box_ = load_model_text(kBox, "box");
};

TEST_F(LogFiles, ColumnsNamedAsTheModelNamesThemNeedNoConfiguration) {
  const auto logs = read_logs({write("run.csv", "time,slider,shoulder,shoulder.torque\n0,0.1,1,5\n0.5,0.2,2,6\n")},
                              arm_, MatchConfig());
  ASSERT_EQ(logs.size(), 1);
  EXPECT_EQ(logs[0].name, "run");
  EXPECT_THAT(logs[0].time, ElementsAre(0, 0.5));
  EXPECT_THAT(logs[0].line, ElementsAre(2, 3));
  ASSERT_EQ(logs[0].joints.size(), 2);
  EXPECT_THAT(logs[0].joint(0)->position, ElementsAre(1, 2));
  EXPECT_THAT(logs[0].joint(0)->torque, ElementsAre(5, 6));
  EXPECT_THAT(logs[0].joint(1)->position, ElementsAre(0.1, 0.2));
  EXPECT_TRUE(logs[0].joint(1)->torque.empty());
  EXPECT_EQ(drive_law(logs, MatchConfig()), DriveLaw::kTorque);
}

TEST_F(LogFiles, UnitsScalesAndOffsetsGiveSi) {
  const std::string file = write("run.csv", "t;q1;q2;tau;note\n0;90;100;1000;1\n1000;180;200;2000;2\n");
  const auto logs = read_logs({file}, arm_, config(R"(
[columns]
time = "t"
shoulder = "q1"
slider = "q2"
"shoulder.torque" = "tau"
ignore = ["no*"]
[units]
time = "ms"
angle = "deg"
length = "mm"
torque = "mNm"
[scale]
"shoulder.torque" = -6
[offset]
shoulder = 0.5
)"));
  EXPECT_THAT(logs[0].time, ElementsAre(0, 1));
  EXPECT_NEAR(logs[0].joint(0)->position[1], M_PI + 0.5, 1e-12);
  EXPECT_NEAR(logs[0].joint(1)->position[0], 0.1, 1e-12);
  EXPECT_NEAR(logs[0].joint(0)->torque[0], -6, 1e-12);
}

TEST_F(LogFiles, MotionsOfOneFileAreLogs) {
  const std::string file = write("tosses.csv",
                                 "toss,time,x,y,z,qw,qx,qy,qz,wx,wy,wz\n"
                                 "1,0,0,0,1,0.7071068,0,0,0.7071068,1,0,0\n1,0.1,0,0,1,0.7071068,0,0,0.7071068,1,0,0\n"
                                 "7,0,0,0,2,1,0,0,0,1,0,0\n7,0.1,0,0,2,-1,0,0,0,1,0,0\n");
  const auto logs = read_logs({file}, box_,
                              config("[columns]\nmotion = \"toss\"\n[frames]\npoint = \"centre_of_mass\"\n"
                                     "angular_velocity = \"body\"\n"));
  ASSERT_EQ(logs.size(), 2);
  EXPECT_EQ(logs[1].name, "tosses/7");
  // a quarter turn about z: the body's x axis is the world's y, in which the centre of mass lies
  EXPECT_LT((logs[0].bodies[0].p_WB[0] - Vec3(0, -0.1, 1)).norm(), 1e-6);
  EXPECT_LT((logs[0].bodies[0].w_WB[0] - Vec3(0, 1, 0)).norm(), 1e-6);
  // one sign over time
  EXPECT_GT(logs[1].bodies[0].q_WB[0].dot(logs[1].bodies[0].q_WB[1]), 0.99);
}

TEST_F(LogFiles, EachMistakeIsASentenceWithLineAndColumn) {
  const auto said = [&](const std::string& text) {
    return message_of([&] { read_logs({write("run.csv", text)}, arm_, MatchConfig()); });
  };
  EXPECT_THAT(said("time,shoulder\n0,1\n0.1,nan\n"),
              HasSubstr("run.csv:3: column 'shoulder': 'nan' is no finite number"));
  EXPECT_THAT(said("time,shoulder\n0,1\n0.1,\n"), HasSubstr("run.csv:3: column 'shoulder'"));
  EXPECT_THAT(said("time,shoulder\n0.1,1\n0.1,2\n"),
              HasSubstr("run.csv:3: column 'time': the time 0.1 does not come after 0.1 in line 2"));
  EXPECT_THAT(said("time,shoulder\n0,1,2\n"), HasSubstr("run.csv:2: the line has 3 fields, and the header 2"));
  EXPECT_THAT(said("time,shouldr\n0,1\n"), HasSubstr("'shouldr' is no joint"));
  EXPECT_THAT(said("time,shouldr\n0,1\n"), HasSubstr("did you mean 'shoulder'?"));
  EXPECT_THAT(said("t,shoulder\n0,1\n"), HasSubstr("no column 'time'"));
  EXPECT_THAT(said("time,shoulder,shoulder\n0,1,1\n"), HasSubstr("two columns are called 'shoulder'"));
  EXPECT_THAT(said("time,shoulder.torque\n0,1\n"), HasSubstr("no column 'shoulder': give the joint's position"));
  EXPECT_THAT(said("0,1\n1,2\n"), HasSubstr("begin with a header"));
  EXPECT_THAT(said(""), HasSubstr("is empty"));
  EXPECT_THAT(said("time,shoulder\n"), HasSubstr("only a header"));
  EXPECT_THAT(said(std::string("time,shoulder\n0,\0\n", 18)), HasSubstr("NUL"));
  EXPECT_THAT(said("\x1f\x8b garbage"), HasSubstr("no gzip file"));
  EXPECT_THAT(said("\xfd\x37zXZ garbage"), HasSubstr("xz"));
  EXPECT_THAT(said("PK\x03\x04 garbage"), HasSubstr("no .npz"));
  EXPECT_THAT(message_of([&] {
                read_logs({write("b.csv", "time,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,1,0,0\n")}, box_, MatchConfig());
              }),
              HasSubstr("b.csv:2: column 'qw': the quaternion of 'cube' has norm 1.41"));
}

TEST_F(LogFiles, CommentsAndOldLineEndsAreNoMistakes) {
  for (const char* text :
       {"# of robot 7, in the hall\n# 2 August\ntime,shoulder\n0,1\n# a pause\n1,2\n",
        "# of robot 7\n# time,shoulder\n0,1\n1,2\n", "time,shoulder\r0,1\r1,2\r", "time,shoulder\r\n0,1\r\n\r\n1,2"}) {
    const auto logs = read_logs({write("run.csv", text)}, arm_, MatchConfig());
    EXPECT_THAT(logs[0].time, ElementsAre(0, 1)) << text;
    EXPECT_THAT(logs[0].joint(0)->position, ElementsAre(1, 2)) << text;
  }
}

TEST_F(LogFiles, WhatIsWrittenInAnotherWayHasItsOwnFix) {
  const auto said = [&](const std::string& text) {
    return message_of([&] { read_logs({write("run.csv", text)}, arm_, MatchConfig()); });
  };
  EXPECT_THAT(said("time;shoulder\n0;1,5\n"),
              HasSubstr("run.csv:2: column 'shoulder': '1,5' is no finite number: write "
                        "decimals with a point, as in 1.5"));
  EXPECT_THAT(said("time,shoulder\n2026-08-02T10:00:00,1\n"), HasSubstr("one number of seconds"));
  EXPECT_THAT(said("time shoulder\n0 1\n"), HasSubstr("separate the columns"));
  EXPECT_THAT(said(",time,shoulder\n0,0,1\n1,1,2\n"), HasSubstr("column 1 has no name"));
  EXPECT_THAT(said("time,shoulder\n0,a\n1,b\n2,3\n3,c\n"), HasSubstr("(2 more faults, in lines 3, 5)"));
}

TEST_F(LogFiles, ColumnsOfQuantitiesCanBeLeftOut) {
  const std::string file = write("run.csv", "time,shoulder,shoulder.torque,temperature\n0,1,5,20\n1,2,6,20\n");
  const auto torques = [&](const char* ignore) {
    const auto logs = read_logs({file}, arm_, config(fmt::format("[columns]\nignore = [{}]\n", ignore)));
    return logs[0].joint(0)->torque.size();
  };
  EXPECT_EQ(torques("\"*\""), 2);
  EXPECT_EQ(torques("\"temperature\""), 2);
  EXPECT_EQ(torques("\"temperature\", \"shoulder.torque\""), 0);
  EXPECT_EQ(torques("\"t*\", \"*.torque\""), 0);
}

TEST_F(LogFiles, SensorsOfOneTurnGoOn) {
  std::string radians = "time,shoulder,shoulder.target\n", degrees = radians;
  const auto wrapped = [](double angle) { return std::remainder(angle, 2 * M_PI); };
  std::vector<double> truth;
  for (int i = 0; i < 400; ++i) {
    truth.push_back(1 + 9 * std::sin(0.02 * i));
    const double q = wrapped(truth.back());
    radians += fmt::format("{},{:.6f},{:.6f}\n", 0.01 * i, q, q);
    degrees += fmt::format("{},{:.6f},{:.6f}\n", 0.01 * i, q / kDegree, q / kDegree);
  }
  for (const auto& [text, unit] : {std::pair(radians, "rad"), std::pair(degrees, "deg")}) {
    const auto logs = read_logs({write("run.csv", text)}, arm_, config(fmt::format("[units]\nangle = \"{}\"\n", unit)));
    EXPECT_GT(logs[0].joint(0)->turns.size(), 2);
    for (size_t i = 0; i < truth.size(); ++i) {
      EXPECT_NEAR(logs[0].joint(0)->position[i], truth[i], 1e-5) << i;
      EXPECT_NEAR(logs[0].joint(0)->target[i], truth[i], 1e-5) << i;
    }
  }
  // a sample that stands alone is no turn, and what goes beyond one turn was never wrapped
  std::vector<double> course;
  for (int i = 0; i < 50; ++i) course.push_back(0.01 * i);
  course[20] += 5;
  EXPECT_THAT(jumps_of_turn(course, 2 * M_PI), ElementsAre());
  course[20] += 2;
  EXPECT_THAT(jumps_of_turn(course, 2 * M_PI), ElementsAre());
}

TEST_F(LogFiles, FaultsAreListedAndTheRestIsRead) {
  std::string text = "time,shoulder\n";
  for (int i = 0; i < 60; ++i) text += std::to_string(i) + (i % 2 == 0 ? ",1\n" : ",nan\n");
  const LogFile file = inspect_log_file(write("run.csv", text), arm_, MatchConfig());
  EXPECT_EQ(file.faults.size(), 20);
  EXPECT_EQ(file.more_faults, 10);
  ASSERT_EQ(file.logs.size(), 1);
  EXPECT_EQ(file.logs[0].samples(), 30);
}

TEST_F(LogFiles, NamesOfTheConfigurationAreChecked) {
  const std::string file = write("run.csv", "time,shoulder\n0,1\n1,2\n");
  const auto said = [&](const std::string& text) { return message_of([&] { read_logs({file}, arm_, config(text)); }); };
  EXPECT_THAT(said("[columns]\nshouldr = \"q\"\n"), HasSubstr("match.toml:2: 'shouldr' in [columns] is no quantity"));
  EXPECT_THAT(said("[columns]\nshoulder = \"q\"\n"), HasSubstr("has no column 'q'"));
  EXPECT_THAT(said("[rows]\nrum = [[0, 1]]\n"),
              HasSubstr("match.toml:2: no log is called 'rum' (did you mean 'run'?)"));
  EXPECT_THAT(said("[rows]\nrun = [[5, 6]]\n"), HasSubstr("lies outside of 'run', which goes from 0 to 1 s"));
  EXPECT_THAT(said("[columns]\nbody = \"cube\"\n"), HasSubstr("'cube' is no free body of 'arm'"));
  EXPECT_EQ(said("[rows]\n\"r*\" = [[0, 0.5]]\n"), "");
}

TEST(RunningMedian, RemovesWhatIsShorterThanHalfOfIt) {
  EXPECT_THAT(running_median({1, 1, 9, 9, 1, 1, 1}, 5), ElementsAre(1, 1, 1, 1, 1, 1, 1));
  EXPECT_THAT(running_median({1, 2, 3}, 1), ElementsAre(1, 2, 3));
  EXPECT_THAT(running_median({}, 9), ElementsAre());
}

TEST(WithoutGlitches, TakesOutWhatStandsAloneAndKeepsPeaks) {
  std::vector<double> wave, spiked;
  for (int i = 0; i < 60; ++i) wave.push_back(std::sin(0.3 * i));
  EXPECT_EQ(without_glitches(wave, 9), wave);
  spiked = wave;
  spiked[20] = 40;
  spiked[21] = -40;
  const std::vector<double> mended = without_glitches(spiked, 9);
  for (size_t i = 0; i < wave.size(); ++i) EXPECT_NEAR(mended[i], wave[i], i == 20 || i == 21 ? 0.5 : 1e-12) << i;
  EXPECT_EQ(without_glitches(spiked, 1), spiked);
  EXPECT_THAT(without_glitches({}, 9), ElementsAre());
}

}  // namespace
}  // namespace assay::match
