// SPDX-License-Identifier: Apache-2.0
// The only file that includes the NetCDF C library.
#include "dpde/runtime/netcdf.h"

#include <fmt/format.h>
#include <hdf5.h>
#include <netcdf.h>
#include <netcdf_mem.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <set>
#include <string_view>
#include <utility>

#include "dpde/runtime/atomic_file.h"
#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"

namespace dpde {
namespace {

/// The library is not thread-safe, even for different files (NetCDF-C's FAQ). HDF5 would print to standard error of
/// each new thread whenever NetCDF looks for something that does not exist.
class Turn {
 public:
  Turn() : lock_(of_library()) { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

 private:
  static std::recursive_mutex& of_library() {
    static std::recursive_mutex one;
    return one;
  }
  std::lock_guard<std::recursive_mutex> lock_;
};

void must(int status) {
  if (status != NC_NOERR) throw Error(ErrorKind::machine, fmt::format("NetCDF: {}", nc_strerror(status)));
}

/// Longer texts do not fit into the header of an object and are stored separately.
constexpr std::size_t longest_in_header = 60000;

/// Names in other programs are words: u.x is stored as u_x, with the original name as an attribute.
constexpr const char* name_attribute = "dpde_name";

/// Smaller variables are not compressed; of others about so many values are compressed in one piece.
constexpr std::size_t least_compressed = 4096;
constexpr auto values_of_chunk = static_cast<std::size_t>(NetcdfContent::values_at_once);

/// The library rounds up: bytes after the end stated in the file are not part of it.
std::size_t used_bytes(const char* bytes, std::size_t size) {
  constexpr std::size_t version_at = 8, end_at[] = {40, 40, 28, 28};  // of the superblock's versions 0 to 3
  const unsigned version = size > 64 ? static_cast<unsigned char>(bytes[version_at]) : 4;
  if (version > 3) return size;
  std::uint64_t end = 0;
  std::memcpy(&end, bytes + end_at[version], sizeof end);
  return end > 64 && end < size ? end : size;
}

/// After the end of a file that dpde wrote, where NetCDF does not look: mark and checksum. Damage inside a file can
/// give the library wrong numbers or an endless loop, so damaged files must never reach it.
constexpr std::string_view checksum_mark = "dpdesum1";

std::string checksum_of(std::uint64_t hash) {
  return std::string(checksum_mark) + std::string(reinterpret_cast<const char*>(&hash), sizeof hash);
}

/// False if the file has a checksum of other bytes.
bool is_as_written(std::string_view bytes) {
  const std::size_t size = checksum_mark.size() + sizeof(std::uint64_t);
  if (bytes.size() < size) return true;
  const std::string_view content = bytes.substr(0, bytes.size() - size), end = bytes.substr(content.size());
  return !end.starts_with(checksum_mark) || end == checksum_of(hash_bytes(content.data(), content.size()));
}

/// Ids of the library.
struct Place {
  int group, variable;
};

/// A file under construction, in memory or under a name; discarded unless it is finished.
class Composer {
 public:
  Composer() : Composer(nullptr) {
    constexpr std::size_t first_bytes = 1 << 16;  // grows as needed
    must(nc_create_mem("memory.nc", NC_NETCDF4, first_bytes, &id_));
    begin();
  }
  /// The library crashes if it cannot write: space for all bytes is reserved before.
  explicit Composer(AtomicFile& file) : Composer(&file) {
    const std::string name = file.name();
    file.reserve(room_of_headers);
    must(nc_create(name.c_str(), NC_NETCDF4 | NC_CLOBBER, &id_));
    begin();
    file.reserve(room_of_headers);
  }
  ~Composer() {
    if (id_ >= 0) nc_abort(id_);
  }
  Composer(const Composer&) = delete;
  Composer& operator=(const Composer&) = delete;

  void add(const NetcdfAttributes& attributes) { add(attributes, {id_, NC_GLOBAL}); }
  void add(const NetcdfAttributes& attributes, const Place& at) {
    const auto [group, variable] = at;
    for (const auto& [name, value] : attributes) {
      const std::string* text = std::get_if<std::string>(&value);
      if (text != nullptr && text->size() > longest_in_header) {
        const char* characters = text->c_str();
        must(nc_put_att_string(group, variable, name.c_str(), 1, &characters));
      } else if (text != nullptr) {
        must(nc_put_att_text(group, variable, name.c_str(), text->size(), text->data()));
      } else {
        must(nc_put_att_double(group, variable, name.c_str(), NC_DOUBLE, 1, &std::get<double>(value)));
      }
    }
  }
  void add(const NetcdfDimension& dimension) {
    int number = 0;
    must(nc_def_dim(id_, dimension.name.c_str(), static_cast<std::size_t>(dimension.length), &number));
  }
  Place declare(const NetcdfVariable& variable, const std::string& stored_name) {
    std::vector<int> dimensions;
    for (const std::string& name : variable.dimensions)
      must(nc_inq_dimid(id_, name.c_str(), &dimensions.emplace_back()));
    Place place{id_of(variable.group), 0};
    must(nc_def_var(place.group, stored_name.c_str(), variable.is_single ? NC_FLOAT : NC_DOUBLE,
                    static_cast<int>(dimensions.size()), dimensions.data(), &place.variable));
    if (count_of(dimensions) >= least_compressed) compress(place, dimensions);
    if (file_ != nullptr && !dimensions.empty()) must(nc_set_var_chunk_cache(place.group, place.variable, 0, 0, 0));
    if (stored_name != variable.name) add({{name_attribute, variable.name}}, place);
    add(variable.attributes, place);
    return place;
  }
  void begin_data() { must(nc_enddef(id_)); }
  /// In the same pieces as compression, so that the bytes are identical.
  void put(const Place& place, NetcdfVariable& variable) const {
    const std::vector<double> values = std::exchange(variable.values, {});
    if (!variable.part) {
      reserve(values.size());
      return must(nc_put_var_double(place.group, place.variable, values.data()));
    }
    std::vector<std::size_t> start(variable.dimensions.size(), 0), count = lengths_of(variable.dimensions);
    const std::size_t all = count[0], at_once = indices_at_once(place, count);
    for (; start[0] < all; start[0] += at_once) {
      count[0] = std::min(at_once, all - start[0]);
      const std::vector<double> part =
          variable.part(static_cast<std::int64_t>(start[0]), static_cast<std::int64_t>(count[0]));
      reserve(part.size());
      must(nc_put_vara_double(place.group, place.variable, start.data(), count.data(), part.data()));
    }
  }
  void close() { must(nc_close(std::exchange(id_, -1))); }
  /// Returns the bytes and their checksum.
  std::string finish() {
    NC_memio memory{};
    must(nc_close_memio(std::exchange(id_, -1), &memory));
    const std::unique_ptr<void, decltype(&std::free)> owner(memory.memory, &std::free);
    const char* bytes = static_cast<const char*>(memory.memory);
    const std::string_view used(bytes, used_bytes(bytes, memory.size));
    const std::string checksum = checksum_of(hash_bytes(used.data(), used.size()));
    std::string all;
    all.reserve(used.size() + checksum.size());
    all.append(used).append(checksum);
    return all;
  }

 private:
  /// Delegated to, so that an exception of the other constructors runs the destructor, which closes the file.
  explicit Composer(AtomicFile* file) : file_(file) {}
  void begin() const {
    int old = 0;
    must(nc_set_fill(id_, NC_NOFILL, &old));  // everything is written
  }
  void reserve(std::size_t values) const {
    if (file_ != nullptr) file_->reserve(static_cast<std::int64_t>(values * sizeof(double)) + room_of_headers);
  }
  std::size_t length_of(int dimension) const {
    std::size_t length = 0;
    must(nc_inq_dimlen(id_, dimension, &length));
    return length;
  }
  std::vector<std::size_t> lengths_of(const std::vector<std::string>& names) const {
    std::vector<std::size_t> lengths;
    for (const std::string& name : names) {
      int dimension = 0;
      must(nc_inq_dimid(id_, name.c_str(), &dimension));
      lengths.push_back(length_of(dimension));
    }
    return lengths;
  }
  std::size_t count_of(const std::vector<int>& dimensions) const {
    std::size_t count = 1;
    for (const int dimension : dimensions) count *= length_of(dimension);
    return count;
  }
  /// Number of indices of the first dimension in one piece: those of a chunk, or all.
  static std::size_t indices_at_once(const Place& place, const std::vector<std::size_t>& lengths) {
    int storage = NC_CONTIGUOUS;
    std::vector<std::size_t> chunk(lengths.size());
    must(nc_inq_var_chunking(place.group, place.variable, &storage, chunk.data()));
    return storage == NC_CHUNKED ? chunk[0] : lengths[0];
  }
  /// Lossless. Chunks span the last axes, so that a state can be read without those before it.
  void compress(const Place& place, const std::vector<int>& dimensions) const {
    constexpr int with_shuffle = 1, with_deflate = 1, fastest = 1;
    std::vector<std::size_t> chunk(dimensions.size(), 1);
    std::size_t values = 1;
    for (std::size_t d = dimensions.size(); d-- > 0 && values < values_of_chunk;) {
      chunk[d] = std::clamp(values_of_chunk / values, std::size_t{1}, length_of(dimensions[d]));
      values *= chunk[d];
    }
    must(nc_def_var_chunking(place.group, place.variable, NC_CHUNKED, chunk.data()));
    must(nc_def_var_deflate(place.group, place.variable, with_shuffle, with_deflate, fastest));
  }

  /// Creates the group if it does not exist.
  int id_of(const std::string& group) const {
    int id = id_;
    if (!group.empty() && nc_inq_grp_ncid(id_, group.c_str(), &id) != NC_NOERR)
      must(nc_def_grp(id_, group.c_str(), &id));
    return id;
  }

  static constexpr std::int64_t room_of_headers = 1 << 20;  // of the file, and of the index of its chunks
  int id_ = -1;
  AtomicFile* file_;  // null: in memory
};

/// Names of the variables in the file: without dots, all different.
std::vector<std::string> stored_names(const std::vector<NetcdfVariable>& variables) {
  std::set<std::string> taken;
  for (const NetcdfVariable& variable : variables) taken.insert(variable.name);
  std::vector<std::string> names;
  for (const NetcdfVariable& variable : variables) {
    std::string name = variable.name;
    std::ranges::replace(name, '.', '_');
    while (name != variable.name && !taken.insert(name).second) name += '_';
    names.push_back(std::move(name));
  }
  return names;
}

bool is_number(nc_type type) { return type >= NC_BYTE && type <= NC_UINT64 && type != NC_CHAR; }

}  // namespace

std::string stored_name(const NetcdfContent& content, const std::string& variable) {
  const auto found = std::ranges::find(content.variables, variable, &NetcdfVariable::name);
  if (found == content.variables.end()) return variable;
  return stored_names(content.variables)[static_cast<std::size_t>(found - content.variables.begin())];
}

namespace {

void write_content(Composer& file, NetcdfContent& content) {
  file.add(content.attributes);
  for (const NetcdfDimension& dimension : content.dimensions) file.add(dimension);
  std::vector<Place> places;
  const std::vector<std::string> names = stored_names(content.variables);
  for (std::size_t i = 0; i < names.size(); ++i) places.push_back(file.declare(content.variables[i], names[i]));
  file.begin_data();
  for (std::size_t i = 0; i < places.size(); ++i) file.put(places[i], content.variables[i]);
}

/// Truncates the file at the end of the NetCDF data and appends the checksum.
void append_checksum(AtomicFile& file) {
  std::vector<char> buffer(std::size_t{1} << 16);
  std::error_code error;
  const auto size = static_cast<std::size_t>(std::filesystem::file_size(file.name(), error));
  const std::size_t used = used_bytes(file.read(0, buffer).data(), size);
  file.cut(static_cast<std::int64_t>(used));
  std::uint64_t hash = hash_bytes(nullptr, 0);
  for (std::size_t at = 0; at < used;) {
    const std::string_view part = file.read(static_cast<std::int64_t>(at), buffer);
    if (part.empty()) break;
    hash = hash_bytes(part.data(), part.size(), hash);
    at += part.size();
  }
  file.append(checksum_of(hash));
}

}  // namespace

std::string compose_netcdf(NetcdfContent content) {
  const Turn turn;
  Composer file;
  write_content(file, content);
  return file.finish();
}

void write_netcdf(const std::filesystem::path& path, NetcdfContent content) {
  AtomicFile file(path);
  if (file.name().empty()) {  // a pipe or a device
    file.append(compose_netcdf(std::move(content)));
    return file.finish();
  }
  try {
    const Turn turn;
    Composer composer(file);
    write_content(composer, content);
    composer.close();
  } catch (const Error& error) {
    if (std::string_view(error.what()).starts_with("cannot write")) throw;
    throw Error(ErrorKind::machine, fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  append_checksum(file);
  file.finish();
}

NetcdfReader::NetcdfReader(std::string bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {
  if (!is_as_written(bytes_)) {
    throw Error(ErrorKind::input, fmt::format("{} is damaged: its checksum is that of other content", name_));
  }
  const Turn turn;
  check(nc_open_mem(name_.c_str(), NC_NOWRITE, bytes_.size(), bytes_.data(), &id_));
  try {
    list_variables("");
    int is_there = 0;
    if (nc_inq_grp_ncid(id_, group_of_numbers, &is_there) == NC_NOERR) list_variables(group_of_numbers);
  } catch (const Error&) {
    nc_close(id_);
    throw;
  }
}

NetcdfReader::~NetcdfReader() {
  const Turn turn;
  nc_close(id_);
}

void NetcdfReader::check(int status) const {
  if (status == NC_NOERR) return;
  throw Error(ErrorKind::input, fmt::format("{} is no NetCDF file or is damaged: {}", name_, nc_strerror(status)));
}

int NetcdfReader::id_of_group(const std::string& group) const {
  int id = id_;
  if (!group.empty()) check(nc_inq_grp_ncid(id_, group.c_str(), &id));
  return id;
}

void NetcdfReader::list_variables(const std::string& group) {
  const int id = id_of_group(group);
  int count = 0;
  check(nc_inq_nvars(id, &count));
  for (int v = 0; v < count; ++v) {
    std::array<char, NC_MAX_NAME + 1> name{};
    nc_type type = NC_NAT;
    int rank = 0;
    check(nc_inq_var(id, v, name.data(), &type, &rank, nullptr, nullptr));
    if (!is_number(type)) continue;
    std::vector<int> dimensions(static_cast<std::size_t>(rank));
    check(nc_inq_vardimid(id, v, dimensions.data()));
    Variable variable{name.data(), {}, {}, name.data(), group};
    if (find(variable.name) != nullptr) continue;  // the times of the numbers are those of the states
    variable.name = text_of(id, v, name_attribute).value_or(variable.stored_name);
    for (const int dimension : dimensions) {
      std::size_t length = 0;
      check(nc_inq_dim(id, dimension, name.data(), &length));
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

std::optional<double> NetcdfReader::number(int group, int variable, const char* attribute) const {
  std::size_t length = 0;
  double value = 0;
  if (nc_inq_attlen(group, variable, attribute, &length) != NC_NOERR || length != 1) return std::nullopt;
  return nc_get_att_double(group, variable, attribute, &value) == NC_NOERR ? std::optional(value) : std::nullopt;
}

std::vector<double> NetcdfReader::read(const Variable& variable, std::optional<std::int64_t> index) const {
  const Turn turn;
  const int group = id_of_group(variable.group);
  int number_of = 0;
  check(nc_inq_varid(group, variable.stored_name.c_str(), &number_of));
  std::vector<std::size_t> start(variable.shape.size(), 0), length(variable.shape.begin(), variable.shape.end());
  if (index) {
    start.at(0) = static_cast<std::size_t>(*index);
    length.at(0) = 1;
  }
  // A damaged header may state more values than possible. Upper bound of the compression of many equal numbers.
  constexpr std::size_t most_compression = 1100;
  std::size_t count = 1;
  for (const std::size_t n : length) {
    if (n != 0 && count > bytes_.size() * most_compression / n) check(NC_EVARSIZE);
    count *= n;
  }
  std::vector<double> values(count);
  if (count > 0) check(nc_get_vara_double(group, number_of, start.data(), length.data(), values.data()));
  const std::optional<double> missing = number(group, number_of, "_FillValue");
  const double scale = number(group, number_of, "scale_factor").value_or(1),
               offset = number(group, number_of, "add_offset").value_or(0);
  for (double& value : values) {
    value = missing && value == *missing ? std::numeric_limits<double>::quiet_NaN() : value * scale + offset;
  }
  return values;
}

std::optional<std::string> NetcdfReader::text(const std::string& variable, const std::string& attribute) const {
  const Turn turn;
  if (variable.empty()) return text_of(id_, NC_GLOBAL, attribute);
  const std::optional<std::pair<int, int>> place = place_of(variable);
  return place ? text_of(place->first, place->second, attribute) : std::nullopt;
}

std::optional<double> NetcdfReader::number(const std::string& variable, const std::string& attribute) const {
  const Turn turn;
  const std::optional<std::pair<int, int>> place = place_of(variable);
  return place ? number(place->first, place->second, attribute.c_str()) : std::nullopt;
}

std::optional<std::pair<int, int>> NetcdfReader::place_of(const std::string& variable) const {
  const Variable* known = find(variable);
  const int group = id_of_group(known == nullptr ? "" : known->group);
  const std::string& stored_name = known == nullptr ? variable : known->stored_name;
  int number_of = 0;
  if (nc_inq_varid(group, stored_name.c_str(), &number_of) != NC_NOERR) return std::nullopt;
  return std::pair(group, number_of);
}

std::optional<std::string> NetcdfReader::text_of(int group, int variable, const std::string& attribute) const {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(group, variable, attribute.c_str(), &type, &length) != NC_NOERR) return std::nullopt;
  if (type == NC_STRING && length == 1) {
    char* characters = nullptr;
    check(nc_get_att_string(group, variable, attribute.c_str(), &characters));
    const std::string value = characters == nullptr ? "" : characters;
    nc_free_string(1, &characters);
    return value;
  }
  if (type != NC_CHAR) return std::nullopt;
  std::string value(length, '\0');
  check(nc_get_att_text(group, variable, attribute.c_str(), value.data()));
  return value;
}

}  // namespace dpde
