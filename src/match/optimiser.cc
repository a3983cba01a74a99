#include "match/optimiser.h"

#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/paths.h"
#include "isolate/sandbox.h"

namespace assay::match {
namespace {

constexpr std::string_view kScript =
#include "optimiser.inc"
    ;

std::string interpreter() {
  return (std::filesystem::path(cache_dir()) / "python" / ASSAY_MATCH_ENVIRONMENT / "bin" / "python").string();
}

}  // namespace

void Optimiser::require_environment() {
  if (std::filesystem::exists(interpreter())) return;
  throw InputError("the optimiser of 'assay match' (SciPy and pycma) is not set up: run ./assay setup match (240 MB)");
}

Optimiser::Optimiser(const nlohmann::json& task) {
  require_environment();
  Pipe input = make_pipe(), output = make_pipe(), errors = make_pipe();
  const std::string python = interpreter(), script(kScript);
  // isolated from the user's packages; one thread, so that sums have one order
  const std::vector<std::string> variables = {"OPENBLAS_NUM_THREADS=1", "OMP_NUM_THREADS=1", "PYTHONHASHSEED=0",
                                              "PYTHONDONTWRITEBYTECODE=1", "LC_ALL=C.UTF-8"};
  process_ = start_child([&] {
    ::dup2(input.reading.get(), STDIN_FILENO);
    ::dup2(output.writing.get(), STDOUT_FILENO);
    ::dup2(errors.writing.get(), STDERR_FILENO);
    ::signal(SIGPIPE, SIG_DFL);
    enter_sandbox({.read_everything = true});
    std::array<const char*, 6> arguments = {python.c_str(), "-I", "-B", "-c", script.c_str(), nullptr};
    std::vector<const char*> environment;
    for (const std::string& variable : variables) environment.push_back(variable.c_str());
    environment.push_back(nullptr);
    ::execve(python.c_str(), const_cast<char* const*>(arguments.data()), const_cast<char* const*>(environment.data()));
    constexpr int kCannotExec = 127;
    return kCannotExec;
  });
  to_ = std::move(input.writing), from_ = std::move(output.reading), errors_ = std::move(errors.reading);
  answer(task);
}

Optimiser::~Optimiser() {
  if (process_ < 0) return;
  ::kill(process_, SIGKILL);
  wait_for(process_);
}

void Optimiser::answer(const nlohmann::json& answer) {
  // where it has ended next() says why
  static_cast<void>(write_all(to_.get(), dump_json(answer) + "\n"));
}

nlohmann::json Optimiser::next() {
  size_t end = std::string::npos;
  while ((end = received_.find('\n')) == std::string::npos) {
    if (read_available(from_.get(), received_, 1)) continue;
    std::string words = read_to_end(errors_.get());
    while (!words.empty() && words.back() == '\n') words.pop_back();
    const size_t line = words.rfind('\n');
    throw SystemError(
        fmt::format("the optimiser has ended: {}", line == std::string::npos ? words : words.substr(line + 1)));
  }
  nlohmann::json message = nlohmann::json::parse(std::string_view(received_).substr(0, end), nullptr, false);
  received_.erase(0, end + 1);
  if (!message.is_object()) throw SystemError("the optimiser has said something that is no message");
  return message;
}

}  // namespace assay::match
