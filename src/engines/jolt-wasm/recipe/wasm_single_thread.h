// Included before everything. WebAssembly without threads has a C++ library without locks; Jolt names them all the
// same, and with one thread they are nothing.
#pragma once

#include <chrono>
#include <cstddef>

namespace std {

struct mutex {
  void lock() {}
  bool try_lock() { return true; }
  void unlock() {}
};
struct shared_mutex : mutex {
  void lock_shared() {}
  bool try_lock_shared() { return true; }
  void unlock_shared() {}
};
template <typename M>
struct shared_lock {
  explicit shared_lock(M& /*mutex*/) {}
};
struct condition_variable {
  void notify_one() {}
  void notify_all() {}
  template <typename L, typename P>
  void wait(L& /*lock*/, P /*until*/) {}
};
struct thread {
  using id = std::size_t;
  template <typename... A>
  explicit thread(A&&... /*unused*/) {}
  static unsigned hardware_concurrency() { return 1; }
  bool joinable() const { return false; }
  void join() {}
};
namespace this_thread {
inline thread::id get_id() { return 1; }
inline void yield() {}
template <typename D>
void sleep_for(const D& /*time*/) {}
}  // namespace this_thread

}  // namespace std
