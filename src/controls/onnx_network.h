// Networks in ONNX files, run by ONNX Runtime: the shared library of its Python package, which set-up unpacks and which
// is loaded with the first network. It reads the file's content from memory and uses one thread.
#pragma once

#include <memory>
#include <string>

#include "controls/policy.h"

namespace assay {

// Whether the library is there.
bool has_onnx_runtime();

// The library's message on one line, without its source files and C++ signatures: of "model.cc:149
// ns::Model::Model(ns::Proto&&) Unsupported model IR version: 12" the words behind the signature.
std::string onnx_words(const std::string& message);

// `bytes` is the content of the file `path`, which is for messages. The network has one input of `config.inputs()`
// numbers and an output of one for each action, float or double; a first dimension that is not fixed becomes 1.
// Throws InputError for any other, naming both sides, and where the library is not there. act() throws PolicyError.
std::unique_ptr<ActionSource> onnx_network(const std::string& bytes, const std::string& path,
                                           const PolicyConfig& config);

}  // namespace assay
