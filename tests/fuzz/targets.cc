#include "targets.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdlib.h>  // NOLINT(*-deprecated-headers): mkdtemp
#include <unistd.h>

namespace assay::fuzz {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  Folder() {
    const char* base = ::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp";
    path_ = std::string(base) + "/assay-fuzz-XXXXXX";
    if (::mkdtemp(path_.data()) == nullptr) std::abort();
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

const std::map<std::string, Target>& targets() {
  static const std::map<std::string, Target> all = {{"mjcf", read_mjcf},
                                                    {"urdf", read_urdf},
                                                    {"mesh", read_mesh},
                                                    {"csv", read_csv},
                                                    {"store", read_store},
                                                    {"rows", read_rows},
                                                    {"campaign", read_campaign},
                                                    {"messages", read_messages},
                                                    {"trajectory", read_trajectory},
                                                    {"policy", read_policy},
                                                    {"environment", read_environment}};
  return all;
}

const std::string& scratch() {
  static const Folder folder;
  return folder.path();
}

std::string write_file(const std::string& name, std::string_view bytes) {
  const std::string path = scratch() + "/" + name;
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) std::abort();
  return path;
}

}  // namespace assay::fuzz
