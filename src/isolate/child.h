// Child processes: their start, the bytes between them and their parent, and their end. What confines one is in
// sandbox.h and limits.h, what limits its time in time_limit.h, what ends everything below it in guard.h.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <sys/types.h>
#include <utility>

namespace assay {

// A file descriptor that is closed with its owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) {
      close();
      number_ = other.release();
    }
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int get() const { return number_; }  // -1: none, as poll() takes it
  bool is_open() const { return number_ >= 0; }
  int release() { return std::exchange(number_, -1); }
  void close();

 private:
  int number_ = -1;
};

struct Pipe {
  Descriptor reading, writing;
};

// Programs that are executed do not inherit its ends. Throws SystemError.
Pipe make_pipe();
// Two ends of a stream, both of which read and write: `reading` is the parent's by custom. Throws SystemError.
Pipe make_socket_pair();

// False when nobody reads any more. Does not raise SIGPIPE on a socket.
bool write_all(int to, const void* data, size_t size);
bool write_all(int to, const std::string& text);

// False when the other end has closed before `size` bytes came.
bool read_all(int from, void* data, size_t size);

// Until the other end closes, or fails.
std::string read_to_end(int from);

// Adds what is there, `most` bytes or a few more at a time. False when no more will come; true too where a descriptor
// that does not block has nothing now.
bool read_available(int from, std::string& to, size_t most);

// Runs `work` in a child that ends with this process (SIGKILL); its result is the exit status. The child runs nothing
// else of the parent: no destructors, no handlers of exit. `work` must not throw. Throws SystemError when no process
// can be started.
pid_t start_child(const std::function<int()>& work);

// Waits for the child's end, as waitpid() gives it.
int wait_for(pid_t child);

// "SIGSEGV (Segmentation fault)"
std::string signal_text(int signal);

// "signal 11 (Segmentation fault)", "exit status 3", "no exit status"
std::string end_text(int status);

}  // namespace assay
