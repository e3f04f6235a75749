// SPDX-License-Identifier: Apache-2.0
// NetCDF-4 files, as bytes in memory or written bit by bit.
// A library of its own (dpde_io): the rest of the runtime needs nothing but the compiler's standard library.
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
/// Values in C order: the last dimension is the fastest. Without dimensions: one number. Stored as float64, or float32,
/// compressed without loss where there are many. Dots of a name are stored as _; NetcdfReader knows the name proper.
struct NetcdfVariable {
  std::string name;
  std::vector<std::string> dimensions;
  NetcdfAttributes attributes;
  std::vector<double> values;
  bool is_single = false;
  std::string group = "";  // "": the one that holds all others
  /// In place of `values`, where not all are held at once: those of the indices from `first` of the first dimension.
  std::function<std::vector<double>(std::int64_t first, std::int64_t count)> part = {};
};
/// The group of what is one number, or one a state: readers of fields, as ParaView's, look for them above and complain
/// of what is none.
inline constexpr const char* group_of_numbers = "numbers";
struct NetcdfContent {
  /// About so many values are compressed, and asked for, at once: of larger states one.
  static constexpr double values_at_once = 1 << 18;
  std::vector<NetcdfDimension> dimensions;
  std::vector<NetcdfVariable> variables;
  NetcdfAttributes attributes;
};

/// What the variable is called in the file: without dots, and as no other one.
std::string stored_name(const NetcdfContent& content, const std::string& variable);

/// The bytes of a file with this content; equal content gives equal bytes. A checksum stands behind the end of the file
/// proper, where other programs do not look. Values are given back as they are written.
/// @throws Error(machine) when the library fails.
std::string compose_netcdf(NetcdfContent content);
/// The same bytes in a file, which is whole or not there (atomic_file.h). Of a variable given in parts no more is held
/// than is compressed at once. @throws Error(machine)
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
  /// @throws Error(input) when the bytes are no such file, or one of dpde that was changed since. Damage in files of
  /// others is found by the NetCDF library, as far as it does.
  NetcdfReader(std::string bytes, std::string name);
  ~NetcdfReader();
  NetcdfReader(const NetcdfReader&) = delete;
  NetcdfReader& operator=(const NetcdfReader&) = delete;

  /// Those that hold numbers, of all groups.
  const std::vector<Variable>& variables() const { return variables_; }
  /// nullptr when there is none of that name.
  const Variable* find(const std::string& name) const;
  /// All values, or those at `index` of the first dimension. scale_factor and add_offset are applied; _FillValue
  /// becomes NaN. @throws Error(input) when the file is damaged there.
  std::vector<double> read(const Variable& variable, std::optional<std::int64_t> index = std::nullopt) const;
  /// A text attribute of a variable, or of the file ("").
  std::optional<std::string> text(const std::string& variable, const std::string& attribute) const;
  /// The same of a number.
  std::optional<double> number(const std::string& variable, const std::string& attribute) const;

 private:
  void list_variables(const std::string& group);
  int id_of_group(const std::string& group) const;
  void check(int status) const;
  /// Group and number in it.
  std::optional<std::pair<int, int>> place_of(const std::string& variable) const;
  std::optional<std::string> text_of(int group, int variable, const std::string& attribute) const;
  std::optional<double> number(int group, int variable, const char* attribute) const;

  std::string bytes_, name_;
  int id_ = -1;
  std::vector<Variable> variables_;
};

}  // namespace dpde
