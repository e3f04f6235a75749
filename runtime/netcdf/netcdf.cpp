// SPDX-License-Identifier: Apache-2.0
// The only file that knows the NetCDF C library. It works in memory: files are read and written atomically elsewhere.
#include "dpde/runtime/netcdf.h"

#include <fmt/format.h>
#include <netcdf.h>
#include <netcdf_mem.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

void must(int status) {
  if (status != NC_NOERR) throw Error(ErrorKind::machine, fmt::format("NetCDF: {}", nc_strerror(status)));
}

/// Longer texts do not fit into the header of an object and are stored beside it.
constexpr std::size_t longest_in_header = 60000;

/// The library rounds up: what lies behind the end that the file itself names is no part of it.
std::size_t used_bytes(const char* bytes, std::size_t size) {
  constexpr std::size_t version_at = 8, end_at[] = {40, 40, 28, 28};  // of the superblock's versions 0 to 3
  const unsigned version = size > 64 ? static_cast<unsigned char>(bytes[version_at]) : 4;
  if (version > 3) return size;
  std::uint64_t end = 0;
  std::memcpy(&end, bytes + end_at[version], sizeof end);
  return end > 64 && end < size ? end : size;
}

/// Behind the end of a file that dpde wrote, where NetCDF does not look: mark and checksum. The library takes damage
/// inside a file for anything from wrong numbers to a loop without end, so that it must not see any.
constexpr std::string_view checksum_mark = "dpdesum1";

std::string checksum_of(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037ull;  // FNV-1a
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return std::string(checksum_mark) + std::string(reinterpret_cast<const char*>(&hash), sizeof hash);
}

/// False when the file has a checksum and it is that of other bytes.
bool is_as_written(std::string_view bytes) {
  const std::size_t size = checksum_mark.size() + sizeof(std::uint64_t);
  if (bytes.size() < size) return true;
  const std::string_view content = bytes.substr(0, bytes.size() - size), end = bytes.substr(content.size());
  return !end.starts_with(checksum_mark) || end == checksum_of(content);
}

/// A file that is being made in memory; thrown away unless it is finished.
class Composer {
 public:
  Composer() {
    constexpr std::size_t first_bytes = 1 << 16;  // grows as needed
    must(nc_create_mem("memory.nc", NC_NETCDF4, first_bytes, &id_));
    int old = 0;
    must(nc_set_fill(id_, NC_NOFILL, &old));  // everything is written
  }
  ~Composer() {
    if (id_ >= 0) nc_abort(id_);
  }
  Composer(const Composer&) = delete;
  Composer& operator=(const Composer&) = delete;

  void add(const NetcdfAttributes& attributes, int variable) {
    for (const auto& [name, value] : attributes) {
      const std::string* text = std::get_if<std::string>(&value);
      if (text != nullptr && text->size() > longest_in_header) {
        const char* characters = text->c_str();
        must(nc_put_att_string(id_, variable, name.c_str(), 1, &characters));
      } else if (text != nullptr) {
        must(nc_put_att_text(id_, variable, name.c_str(), text->size(), text->data()));
      } else {
        must(nc_put_att_double(id_, variable, name.c_str(), NC_DOUBLE, 1, &std::get<double>(value)));
      }
    }
  }
  void add(const NetcdfDimension& dimension) {
    int number = 0;
    must(nc_def_dim(id_, dimension.name.c_str(), static_cast<std::size_t>(dimension.length), &number));
  }
  int declare(const NetcdfVariable& variable) {
    std::vector<int> dimensions;
    for (const std::string& name : variable.dimensions)
      must(nc_inq_dimid(id_, name.c_str(), &dimensions.emplace_back()));
    int number = 0;
    must(nc_def_var(id_, variable.name.c_str(), variable.is_single ? NC_FLOAT : NC_DOUBLE,
                    static_cast<int>(dimensions.size()), dimensions.data(), &number));
    add(variable.attributes, number);
    return number;
  }
  void begin_data() { must(nc_enddef(id_)); }
  void put(int variable, const std::vector<double>& values) { must(nc_put_var_double(id_, variable, values.data())); }
  /// The bytes and their checksum.
  std::string finish() {
    NC_memio memory{};
    must(nc_close_memio(std::exchange(id_, -1), &memory));
    const std::unique_ptr<void, decltype(&std::free)> owner(memory.memory, &std::free);
    const char* bytes = static_cast<const char*>(memory.memory);
    const std::string_view used(bytes, used_bytes(bytes, memory.size));
    const std::string checksum = checksum_of(used);
    std::string all;
    all.reserve(used.size() + checksum.size());
    all.append(used).append(checksum);
    return all;
  }

 private:
  int id_ = -1;
};

bool is_number(nc_type type) { return type >= NC_BYTE && type <= NC_UINT64 && type != NC_CHAR; }

}  // namespace

std::string compose_netcdf(NetcdfContent content) {
  Composer file;
  file.add(content.attributes, NC_GLOBAL);
  for (const NetcdfDimension& dimension : content.dimensions) file.add(dimension);
  std::vector<int> numbers;
  for (const NetcdfVariable& variable : content.variables) numbers.push_back(file.declare(variable));
  file.begin_data();
  for (std::size_t i = 0; i < numbers.size(); ++i) file.put(numbers[i], std::exchange(content.variables[i].values, {}));
  return file.finish();
}

NetcdfReader::NetcdfReader(std::string bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {
  if (!is_as_written(bytes_)) {
    throw Error(ErrorKind::input, fmt::format("{} is damaged: its checksum is that of other content", name_));
  }
  check(nc_open_mem(name_.c_str(), NC_NOWRITE, bytes_.size(), bytes_.data(), &id_));
  try {
    list_variables();
  } catch (const Error&) {
    nc_close(id_);
    throw;
  }
}

NetcdfReader::~NetcdfReader() { nc_close(id_); }

void NetcdfReader::check(int status) const {
  if (status == NC_NOERR) return;
  throw Error(ErrorKind::input, fmt::format("{} is no NetCDF file or is damaged: {}", name_, nc_strerror(status)));
}

void NetcdfReader::list_variables() {
  int count = 0;
  check(nc_inq_nvars(id_, &count));
  for (int v = 0; v < count; ++v) {
    std::array<char, NC_MAX_NAME + 1> name{};
    nc_type type = NC_NAT;
    int rank = 0;
    check(nc_inq_var(id_, v, name.data(), &type, &rank, nullptr, nullptr));
    if (!is_number(type)) continue;
    std::vector<int> dimensions(static_cast<std::size_t>(rank));
    check(nc_inq_vardimid(id_, v, dimensions.data()));
    Variable variable{name.data(), {}, {}};
    for (const int dimension : dimensions) {
      std::size_t length = 0;
      check(nc_inq_dim(id_, dimension, name.data(), &length));
      variable.dimensions.push_back(name.data());
      variable.shape.push_back(static_cast<std::int64_t>(length));
    }
    variables_.push_back(std::move(variable));
  }
}

const NetcdfReader::Variable* NetcdfReader::find(const std::string& name) const {
  for (const Variable& variable : variables_) {
    if (variable.name == name) return &variable;
  }
  return nullptr;
}

std::optional<double> NetcdfReader::number(int variable, const char* attribute) const {
  std::size_t length = 0;
  double value = 0;
  if (nc_inq_attlen(id_, variable, attribute, &length) != NC_NOERR || length != 1) return std::nullopt;
  return nc_get_att_double(id_, variable, attribute, &value) == NC_NOERR ? std::optional(value) : std::nullopt;
}

std::vector<double> NetcdfReader::read(const Variable& variable, std::optional<std::int64_t> index) const {
  int number_of = 0;
  check(nc_inq_varid(id_, variable.name.c_str(), &number_of));
  std::vector<std::size_t> start(variable.shape.size(), 0), length(variable.shape.begin(), variable.shape.end());
  if (index) {
    start.at(0) = static_cast<std::size_t>(*index);
    length.at(0) = 1;
  }
  // A damaged header may promise more than there can be; compression makes a small file of many equal numbers.
  constexpr std::size_t most_compression = 1100;
  std::size_t count = 1;
  for (const std::size_t n : length) {
    if (n != 0 && count > bytes_.size() * most_compression / n) check(NC_EVARSIZE);
    count *= n;
  }
  std::vector<double> values(count);
  if (count > 0) check(nc_get_vara_double(id_, number_of, start.data(), length.data(), values.data()));
  const std::optional<double> missing = number(number_of, "_FillValue");
  const double scale = number(number_of, "scale_factor").value_or(1),
               offset = number(number_of, "add_offset").value_or(0);
  for (double& value : values) {
    value = missing && value == *missing ? std::numeric_limits<double>::quiet_NaN() : value * scale + offset;
  }
  return values;
}

std::optional<std::string> NetcdfReader::text(const std::string& variable, const std::string& attribute) const {
  int number_of = NC_GLOBAL;
  if (!variable.empty() && nc_inq_varid(id_, variable.c_str(), &number_of) != NC_NOERR) return std::nullopt;
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(id_, number_of, attribute.c_str(), &type, &length) != NC_NOERR) return std::nullopt;
  if (type == NC_STRING && length == 1) {
    char* characters = nullptr;
    check(nc_get_att_string(id_, number_of, attribute.c_str(), &characters));
    const std::string value = characters == nullptr ? "" : characters;
    nc_free_string(1, &characters);
    return value;
  }
  if (type != NC_CHAR) return std::nullopt;
  std::string value(length, '\0');
  check(nc_get_att_text(id_, number_of, attribute.c_str(), value.data()));
  return value;
}

}  // namespace dpde
