// SPDX-License-Identifier: Apache-2.0
// NetCDF-4 files, as bytes in memory or written piece by piece. A separate library (dpde_io): the rest of the runtime
// needs only the compiler's standard library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace dpde {

using NetcdfAttributes = std::vector<std::pair<std::string, std::variant<std::string, double>>>;

struct NetcdfDimension {
  std::string name;
  std::int64_t length = 0;
};
/// Values in C order: the last dimension is the fastest. Without dimensions: one number. Stored as float64 or float32,
/// with lossless compression if there are many. Dots in a name are stored as _; NetcdfReader restores the name.
struct NetcdfVariable {
  std::string name;
  std::vector<std::string> dimensions;
  NetcdfAttributes attributes;
  std::vector<double> values;
  bool is_single = false;
  std::string group = "";  // "": the root group
  /// Alternative to `values` if they do not fit in memory: returns those with indices from `first` on along the first
  /// dimension.
  std::function<std::vector<double>(std::int64_t first, std::int64_t count)> part = {};
};
/// Group of variables that are one number, or one for each state. Readers of fields such as ParaView search the root
/// group and complain about variables that are not fields.
inline constexpr const char* group_of_numbers = "numbers";
struct NetcdfContent {
  /// About so many values are compressed and requested in one piece; if a state has more, one state.
  static constexpr double values_at_once = 1 << 18;
  std::vector<NetcdfDimension> dimensions;
  std::vector<NetcdfVariable> variables;
  NetcdfAttributes attributes;
};

/// The name of the variable in the file: unique and without dots.
std::string stored_name(const NetcdfContent& content, const std::string& variable);

/// The bytes of a file with this content; equal content gives equal bytes. A checksum follows after the end of the
/// NetCDF data, where other programs do not look. Values are read back exactly.
/// @throws Error(machine) if the library fails.
std::string compose_netcdf(NetcdfContent content);
/// The same bytes in a file, which is complete or absent (atomic_file.h). Of a variable with `part` only one piece is
/// in memory at a time. @throws Error(machine)
void write_netcdf(const std::filesystem::path& path, NetcdfContent content);

/// Reads NetCDF-4 and the classic formats.
class NetcdfReader {
 public:
  struct Variable {
    std::string name;
    std::vector<std::string> dimensions;
    std::vector<std::int64_t> shape;
    std::string stored_name;  // in the file: u_x of u.x
    std::string group = {};
  };

  /// `name` stands for the file in messages.
  /// @throws Error(input) if the bytes are not NetCDF, or if a file of dpde was modified. In files of other programs
  /// only the damage that the NetCDF library detects is found.
  NetcdfReader(std::string bytes, std::string name);
  ~NetcdfReader();
  NetcdfReader(const NetcdfReader&) = delete;
  NetcdfReader& operator=(const NetcdfReader&) = delete;

  /// All numeric variables, of all groups.
  const std::vector<Variable>& variables() const { return variables_; }
  /// nullptr when there is none of that name.
  const Variable* find(const std::string& name) const;
  /// All values, or those at `index` of the first dimension. scale_factor and add_offset are applied; _FillValue
  /// becomes NaN.
  /// @throws Error(input) if the file is damaged there.
  std::vector<double> read(const Variable& variable, std::optional<std::int64_t> index = std::nullopt) const;
  /// A text attribute of a variable, or of the file ("").
  std::optional<std::string> text(const std::string& variable, const std::string& attribute) const;
  /// The same for a numeric attribute.
  std::optional<double> number(const std::string& variable, const std::string& attribute) const;

 private:
  void list_variables(const std::string& group);
  int id_of_group(const std::string& group) const;
  void check(int status) const;
  /// Group, and number of the variable in it.
  std::optional<std::pair<int, int>> place_of(const std::string& variable) const;
  std::optional<std::string> text_of(int group, int variable, const std::string& attribute) const;
  std::optional<double> number(int group, int variable, const char* attribute) const;

  std::string bytes_, name_;
  int id_ = -1;
  std::vector<Variable> variables_;
};

}  // namespace dpde
