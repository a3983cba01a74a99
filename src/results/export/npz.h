// NumPy's archive of arrays: a zip of .npy files, compressed.
#pragma once

#include <string>
#include <vector>

namespace assay {

class Npz {
 public:
  // `shape` is C order; its product is the number of `values`. An empty shape is a single number.
  void add(const std::string& name, const std::vector<size_t>& shape, const std::vector<double>& values);
  // NumPy's Unicode texts, as long as the longest; bytes that are not UTF-8 become U+FFFD.
  void add(const std::string& name, const std::vector<std::string>& texts);

  // Writes the file whole or not at all; equal arrays give equal bytes. Throws SystemError.
  void write(const std::string& path) const;

 private:
  struct Entry {
    std::string name, bytes;
  };
  std::vector<Entry> entries_;
};

}  // namespace assay
