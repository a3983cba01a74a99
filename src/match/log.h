// Measured motion: what was logged of a robot's joints and free bodies, in SI units and the model's terms.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "match/config.h"
#include "model/model.h"

namespace assay::match {

// Of a hinge or slide: one number for each sample, or none at all where the log does not have it.
struct MeasuredJoint {
  int joint = 0;                 // index into Model::joints
  std::vector<double> position;  // rad, m for slides; from the model's zero, as State::position; never empty
  std::vector<double> velocity;  // rad/s, m/s; as logged: filtered or delayed by who knows whom
  std::vector<double> torque;    // Nm, N; at the joint, positive along its axis; as logged, glitches included
  std::vector<double> target;    // rad, m; of a PD drive
  // Samples at which a sensor of one turn begins anew: positions and targets go on there, a whole turn is added.
  std::vector<size_t> turns = {};
};

// Of a free body: one entry for each sample, or none at all.
struct MeasuredBody {
  int body = 0;            // index into Model::bodies
  std::vector<Vec3> p_WB;  // m, origin of the body's frame in the world, whatever point the file had
  std::vector<Quat> q_WB;  // unit; of one sign over time
  std::vector<Vec3> v_WB;  // m/s, of that origin, in world axes; as logged
  std::vector<Vec3> w_WB;  // rad/s, in world axes; as logged
};

// A span of time, both ends included.
struct TimeSpan {
  double from = 0, to = 0;  // s
};

// One motion: a file, or one of the motions of a file with several ("tosses/17").
struct MeasuredLog {
  std::string name;                   // of the file without folder and endings, behind a slash the motion's
  std::string source;                 // path, for messages
  std::vector<double> time;           // s, ascending
  std::vector<size_t> line;           // of each sample: the line of a CSV file, the row (from 1) of an .npz
  std::vector<MeasuredJoint> joints;  // ascending by joint
  std::vector<MeasuredBody> bodies;   // ascending by body
  std::vector<TimeSpan> rows;         // what counts by [rows]; the whole time without one

  size_t samples() const { return time.size(); }
  bool has_torque() const;
  const MeasuredJoint* joint(int index) const;  // null: not logged
  const MeasuredBody* body(int index) const;
};

// A mistake of a file of logs: what keeps it from being used.
struct LogFault {
  std::string source;
  size_t line = 0;     // line or row; 0: of the whole file
  std::string column;  // "": none
  std::string text;    // a sentence with the offending value
  std::string fix;     // what to do, imperative
};
// "file:line: column 'x': text: fix"
std::string fault_text(const LogFault& fault);

// Reads one file (.csv, .csv.gz, .csv.xz, .npz): its motions, and its faults, the first ones of each kind. With faults
// the motions are those of the lines without a fault, for a look; nobody should fit to them. Throws InputError for a
// file that cannot be read or has no header, and where the configuration names what the model does not have.
//
// An .npz has an array for each column, of equal lengths; of an array of two dimensions "q" the columns are "q[0]",
// "q[1]", ... Arrays of other shapes are ignored. Limits: 512 MiB unpacked, 4,000,000 rows, 10,000 columns,
// 100,000 motions.
struct LogFile {
  std::vector<MeasuredLog> logs;
  std::vector<LogFault> faults;
  size_t more_faults = 0;  // beyond those
};
LogFile inspect_log_file(const std::string& path, const Model& model, const MatchConfig& config);

// All motions of these files, in their order. Throws InputError with the first fault, and for two logs of one name.
std::vector<MeasuredLog> read_logs(const std::vector<std::string>& paths, const Model& model,
                                   const MatchConfig& config);

// Throws InputError where [rows] or [held_out] name a log that is not there; read_logs() has done it.
void check_names(const std::vector<MeasuredLog>& logs, const MatchConfig& config);

// Where the values of a sensor of one turn jump from one end of it to the other; nothing for values that do not stay
// within one `turn`.
std::vector<size_t> jumps_of_turn(const std::vector<double>& values, double turn);

// The median of `samples` (odd) around each sample.
std::vector<double> running_median(const std::vector<double>& values, int samples);

// A torque without its glitches: a sample that is more than four standard deviations from that median becomes it
// (Hampel's filter; deviations of the samples around it, by their own median). All others stay: a median flattens
// peaks.
std::vector<double> without_glitches(const std::vector<double>& values, int samples);

// What drives the joints of these logs: the configuration's law, else torques where all logs have them.
DriveLaw drive_law(const std::vector<MeasuredLog>& logs, const MatchConfig& config);

}  // namespace assay::match
