// What reads strangers' files, each as one function of bytes. A target returns when the bytes are accepted or refused
// as they should be (InputError, SystemError); anything else that comes out of it is a finding: a crash, a report of a
// sanitizer, another exception.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace assay::fuzz {

using Target = void (*)(std::string_view bytes);

// mjcf, urdf, mesh, csv, policy, environment, campaign, store, rows, trajectory, messages.
const std::map<std::string, Target>& targets();

void read_mjcf(std::string_view bytes);    // a model's text, up to the findings of `assay check`
void read_urdf(std::string_view bytes);    // the same, and its repair
void read_mesh(std::string_view bytes);    // the first byte is the format
void read_csv(std::string_view bytes);     // the first byte: torques over time, or a configuration
void read_policy(std::string_view bytes);  // a policy's configuration in TOML, or its recorded actions: the first byte
void read_environment(std::string_view bytes);  // YAML that Isaac Lab wrote in training
void read_campaign(std::string_view bytes);     // TOML
void read_store(std::string_view bytes);        // a results database
void read_rows(std::string_view bytes);         // SQL that changes one, whose hashes are made right again
void read_trajectory(std::string_view bytes);   // a file of states without its checksum, which is added
void read_messages(std::string_view bytes);     // a line to a worker, and one of a worker

// A folder of this process in memory, empty at first; removed at its end.
const std::string& scratch();
// Writes the file `name` there and returns its path.
std::string write_file(const std::string& name, std::string_view bytes);

}  // namespace assay::fuzz
