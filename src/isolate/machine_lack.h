// Lack of the machine's memory, room or processes. It says nothing of an engine, so it is never a verdict on one.
#pragma once

#include <exception>
#include <string>

namespace assay {

// The limit of memory under which this process was started, where it is lower than what assay gives a worker itself:
// "146 MiB of addresses (ulimit -v)". Empty without one.
std::string inherited_memory_limit();

// What the machine lacked when `error` was thrown, as one line; empty for any other error. Under an inherited limit of
// memory every error that an engine throws counts: few of them say that an allocation failed.
std::string machine_lack(const std::exception& error);

}  // namespace assay
