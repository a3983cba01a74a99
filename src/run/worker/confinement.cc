#include "run/worker/confinement.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "engines/engine_files.h"
#include "isolate/guard.h"
#include "isolate/sandbox.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// Of this process.
std::vector<std::string>& writable() {
  static std::vector<std::string> folders;
  return folders;
}

std::vector<std::string>& devices() {
  static std::vector<std::string> files;
  return files;
}

// What NVIDIA's driver is spoken to through, where the job steps worlds on a GPU.
std::vector<std::string> devices_of(const Request& job) {
  const auto* batch = std::get_if<BatchJob>(&job);
  std::vector<std::string> files;
  if (batch == nullptr || batch->device == "cpu") return files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev", error)) {
    if (entry.path().filename().string().starts_with("nvidia")) files.push_back(entry.path().string());
  }
  return files;
}

std::string trajectories_of(const Request& job) {
  return std::visit(
      [](const auto& each) -> std::string {
        if constexpr (requires { each.trajectories; }) return each.trajectories;
        return "";
      },
      job);
}

}  // namespace

void confine_worker(const Request& job) {
  std::error_code error;
  const std::string trajectories = trajectories_of(job), scratch = fs::temp_directory_path(error).string();
  if (!trajectories.empty()) {
    // a folder that is not there yet cannot be named to the kernel
    fs::create_directories(trajectories, error);
    writable().push_back(trajectories);
  }
  if (fs::path(scratch).filename().string().starts_with(kScratchPrefix)) writable().push_back(scratch);
  for (std::string& folder : engine_caches()) writable().push_back(std::move(folder));
  devices() = devices_of(job);
  enter_sandbox({.read_everything = true, .devices = devices(), .writable = writable()});
}

void confine_engine() { enter_sandbox({.readable = engine_files(), .devices = devices(), .writable = writable()}); }

}  // namespace assay
