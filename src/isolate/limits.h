// Limits of what a process may take of its machine, by the kernel's resource limits.
#pragma once

#include <cstdint>

namespace assay {

// What a worker and all processes that its engine starts may take of the machine.
struct WorkerLimits {
  // 0: no limit
  std::uint64_t memory_bytes = 0;  // of writable memory of each process (RLIMIT_DATA: reserved addresses do not count)
  std::uint64_t file_bytes = std::uint64_t{4} << 30;  // of each file that is written
  std::uint64_t tasks = 0;                            // of the user, threads count (RLIMIT_NPROC; root has none)

  // For one of `jobs` workers at a time: its share of four fifths of the machine's memory, from 1 to 4 GiB, and 512
  // tasks beyond those that there are.
  static WorkerLimits of_share(int jobs);

  // For a worker that has the machine to itself and holds as much as it can: four fifths of the machine's memory. Its
  // processes share them (run/worker/process_batch.cc).
  static WorkerLimits of_machine();

  // To this process and those that it starts from now on. Only system calls.
  void apply() const;
};

// A core file of a crash helps nobody and takes the user's room. Only system calls.
void write_no_core_file();

}  // namespace assay
