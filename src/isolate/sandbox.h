// What the kernel lets this process do, and all that it starts: files by Landlock, the network and what else engines
// and parsers have no use for by a seccomp filter. There is no way back.
#pragma once

#include <string>
#include <vector>

namespace assay {

struct SandboxRules {
  bool read_everything = false;  // else only `readable`, `writable` and what every process needs of the system
  std::vector<std::string> readable = {};  // files, and folders with all below; programs and libraries there can be run
  std::vector<std::string> devices = {};   // files of /dev that drivers are spoken to through
  std::vector<std::string> writable = {};  // folders: what is below can be read, made, changed and removed
};

// What is in force, or would be.
struct Sandbox {
  int landlock = 0;          // version of the kernel's Landlock; 0: none, files are not confined
  bool filter = false;       // the seccomp filter: without it sockets can be made
  std::string lacking = {};  // one sentence without its end, when anything is not confined

  std::string text() const;  // "files (Landlock 7), network and system (seccomp)"; "nothing: ..."
};

// What enter_sandbox() would do here. Changes nothing. ASSAY_SANDBOX=off in the environment switches everything off,
// folders in ASSAY_SANDBOX_READ (separated by ':') are readable besides.
Sandbox offered_sandbox();

// From now on this process and its children may open only the files of `rules`, make no sockets (pairs of connected
// ones apart), change no permissions and owners, watch no other processes, and send them no signals (Landlock 6).
// What is open stays open. Folders that are not there are left out. Call it before threads are started.
// A second call can only take away more.
Sandbox enter_sandbox(const SandboxRules& rules);

// Programs and libraries that can be there for every process: folders of PATH and LD_LIBRARY_PATH, and beside those
// called "bin" their "lib".
std::vector<std::string> program_folders();

}  // namespace assay
