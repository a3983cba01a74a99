// Havok in Node: the published WebAssembly, run by V8. One Node a process, which holds the instances of all
// simulations; node_host.mjs describes what goes over the socket to it.
#include <bit>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include <spawn.h>

#include "base/errors.h"
#include "isolate/processes.h"
#include "module.h"
#include "plugin.h"

namespace assay::havok_adapter {
namespace {

// Commands of node_host.mjs; the numbers are those of its constants.
enum class Command : std::uint8_t { kHello, kCreate, kDestroy, kCall, kStep };

class Message {
 public:
  explicit Message(Command command) {
    add(std::uint32_t{0});  // the length, known at the end
    add(command);
  }

  template <typename T>
  void add(T number) {
    static_assert(std::endian::native == std::endian::little);
    add_bytes(&number, sizeof number);
  }
  void add_bytes(const void* bytes, size_t size) { bytes_.append(static_cast<const char*>(bytes), size); }
  std::string_view finished() {
    const auto length = static_cast<std::uint32_t>(bytes_.size() - sizeof(std::uint32_t));
    std::memcpy(bytes_.data(), &length, sizeof length);
    return bytes_;
  }

 private:
  std::string bytes_;
};

// node_host.mjs and the WebAssembly lie in a folder beside the plugin.
std::filesystem::path plugin_folder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&plugin_folder), &info) == 0 || info.dli_fname == nullptr) {
    throw EngineError("havok-node cannot find out where it was loaded from");
  }
  return std::filesystem::absolute(info.dli_fname).parent_path();
}

class Node {
 public:
  // The one of this process. A forked process does not use its parent's.
  static std::shared_ptr<Node> get() {
    static std::shared_ptr<Node> node;
    if (!node || node->broken_ || node->owner_ != getpid()) node = std::make_shared<Node>();
    return node;
  }

  Node() {
    const std::filesystem::path folder = plugin_folder() / "havok-node";
    std::string script = (folder / "node_host.mjs").string(), wasm = (folder / "HavokPhysics.wasm").string();
    for (const std::string& file : {script, wasm}) {
      if (!std::filesystem::exists(file)) throw EngineError("havok-node lacks its file '" + file + "'");
    }
    int sockets[2] = {-1, -1};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0) fail("cannot make a socket");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, sockets[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, sockets[1], STDOUT_FILENO);
    std::string program = "node";
    char* const arguments[] = {program.data(), script.data(), wasm.data(), nullptr};
    const int error = posix_spawnp(&process_, program.c_str(), &actions, nullptr, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(sockets[1]);
    socket_ = sockets[0];
    if (error != 0) {
      close(socket_);
      throw EngineError(error == ENOENT
                            ? std::string("Node is not there: install it (Debian: nodejs) or use the contender havok")
                            : std::string("Node cannot be started: ") + std::strerror(error));
    }
    Message hello(Command::kHello);
    std::string names;
    for (const char* name : kFunctionNames) {
      if (!names.empty()) names += '\n';
      names += name;
    }
    hello.add_bytes(names.data(), names.size());
    try {
      const std::vector<char>& reply = ask(hello);
      versions_.assign(reply.begin(), reply.end());
    } catch (...) {
      end();
      throw;
    }
  }

  ~Node() {
    if (owner_ == getpid()) {
      end();
    } else {
      close(socket_);
    }
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  const std::string& versions() const { return versions_; }

  // The reply's content, valid until the next call.
  const std::vector<char>& ask(Message& message) {
    if (broken_) throw EngineError("Node ended before");
    const std::string_view text = message.finished();
    for (size_t done = 0; done < text.size();) {
      const ssize_t sent = send(socket_, text.data() + done, text.size() - done, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) fail("Node ended or does not listen");
      done += static_cast<size_t>(sent);
    }
    std::uint32_t length = 0;
    receive(&length, sizeof length);
    std::uint8_t status = 0;
    receive(&status, sizeof status);
    reply_.resize(length - 1);
    receive(reply_.data(), reply_.size());
    if (status != 0) throw EngineError("Havok in Node: " + std::string(reply_.begin(), reply_.end()));
    return reply_;
  }

 private:
  void receive(void* target, size_t size) {
    for (size_t done = 0; done < size;) {
      const ssize_t got = recv(socket_, static_cast<char*>(target) + done, size - done, 0);
      if (got < 0 && errno == EINTR) continue;
      if (got == 0) errno = 0;
      if (got <= 0) fail("Node ended");
      done += static_cast<size_t>(got);
    }
  }

  [[noreturn]] void fail(const std::string& what) {
    const int error = errno;
    broken_ = true;
    reap();
    throw EngineError(error == 0 ? what : what + ": " + std::strerror(error));
  }

  // Its socket is closed a moment before its end is known. One that somebody else ended is not Havok's failure.
  void reap() {
    constexpr int kMostTries = 1000;  // a millisecond each
    int status = 0;
    for (int i = 0; i < kMostTries && process_ > 0; ++i) {
      const pid_t ended = waitpid(process_, &status, WNOHANG);
      if (ended == 0 || (ended < 0 && errno == EINTR)) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      process_ = -1;
      if (ended > 0) share_end(status);
    }
  }

  void end() const {
    close(socket_);
    if (process_ < 0) return;
    kill(process_, SIGKILL);
    while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }

  pid_t owner_ = getpid(), process_ = -1;
  int socket_ = -1;
  bool broken_ = false;
  std::string versions_;
  std::vector<char> reply_;
};

class NodeModule final : public Module {
 public:
  NodeModule() : node_(Node::get()) {
    Message message(Command::kCreate);
    std::memcpy(&instance_, node_->ask(message).data(), sizeof instance_);
  }
  ~NodeModule() override {
    try {
      Message message = to_instance(Command::kDestroy);
      node_->ask(message);
    } catch (const EngineError&) {  // NOLINT(bugprone-empty-catch): Node is gone, and the instance with it
    }
  }
  NodeModule(const NodeModule&) = delete;
  NodeModule& operator=(const NodeModule&) = delete;

  void call(Function function, std::initializer_list<Arg> arguments) override {
    Message message = to_instance(Command::kCall);
    message.add(function);
    for (const Arg& arg : arguments) {
      message.add(arg.kind);
      switch (arg.kind) {
        case Arg::Kind::kU32:
        case Arg::Kind::kF32:
          message.add(static_cast<std::uint32_t>(arg.bits));
          break;
        case Arg::Kind::kU64:
          message.add(arg.bits);
          break;
        case Arg::Kind::kIn:
          message.add(static_cast<std::uint8_t>(arg.size));
          message.add_bytes(arg.source, arg.size);
          break;
        case Arg::Kind::kOut:
          message.add(static_cast<std::uint8_t>(arg.size));
          break;
        case Arg::Kind::kArray:
          message.add(arg.size);
          message.add_bytes(arg.source, arg.size);
          break;
      }
    }
    const std::vector<char>& reply = node_->ask(message);
    check(reply, kFunctionNames[static_cast<size_t>(function)]);
    const char* from = reply.data() + sizeof(std::uint32_t);
    for (const Arg& arg : arguments) {
      if (arg.kind != Arg::Kind::kOut) continue;
      std::memcpy(arg.target, from, arg.size);
      from += arg.size;
    }
  }

  void step(havok::Id world, float timestep, int count) override {
    Message message = to_instance(Command::kStep);
    message.add(world);
    message.add(timestep);
    message.add(static_cast<std::uint32_t>(count));
    check(node_->ask(message), "HP_World_Step");
  }

 private:
  Message to_instance(Command command) const {
    Message message(command);
    message.add(instance_);
    return message;
  }

  static void check(const std::vector<char>& reply, const char* function) {
    std::uint32_t result = 0;
    std::memcpy(&result, reply.data(), sizeof result);
    if (result != 0) throw EngineError(std::string(function) + " failed with " + std::to_string(result));
  }

  std::shared_ptr<Node> node_;
  std::uint32_t instance_ = 0;
};

}  // namespace

std::unique_ptr<Module> make_module() { return std::make_unique<NodeModule>(); }

BuildFacts build_facts() {
  std::string compiler;
  try {
    compiler = Node::get()->versions();
  } catch (const EngineError& error) {
    compiler = error.what();
  }
  return {ASSAY_BUILD_VERSION, "npm @babylonjs/havok 1.3.14, its WebAssembly as published", compiler,
          "as its makers built it; compiled further by V8 as it runs"};
}

std::vector<Contender> plugin_contenders() {
  return {{"havok-node", "Havok, its WebAssembly in Node: the same results, to show what the route costs", {}}};
}

std::string plugin_note() { return "; a batch of steps takes a round trip to Node, some 30 us, beside its own time"; }

}  // namespace assay::havok_adapter
