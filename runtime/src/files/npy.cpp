// SPDX-License-Identifier: Apache-2.0
// The .npy format: magic, version, length of the header, a Python dictionary of three entries, the numbers.
// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
//
// Nothing in the file is trusted: every length is compared with the actual size before anything is allocated.
#include "dpde/runtime/npy.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <cstring>
#include <optional>

#include "dpde/runtime/atomic_file.h"
#include "dpde/runtime/error.h"
#include "files/header_text.h"
#include "files/read_file.h"

namespace dpde {
namespace {

constexpr std::string_view magic = "\x93NUMPY";
static_assert(std::endian::native == std::endian::little);

struct Header {
  std::string type;  // e.g. "<f8"
  bool fortran_order = false;
  std::vector<int64_t> shape;
};

/// Reads the header's dictionary: {'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }
class NpyHeaderReader : public HeaderText {
 public:
  NpyHeaderReader(std::string_view text, const std::string& file) : HeaderText(text, file, ".npy") {}

  Header read() {
    Header header;
    int seen = 0;
    expect('{');
    while (!accept('}')) {
      const std::string key = quoted();
      expect(':');
      if (key == "descr") {
        header.type = quoted();
        seen |= 1;
      } else if (key == "fortran_order") {
        header.fortran_order = boolean();
        seen |= 2;
      } else if (key == "shape") {
        header.shape = tuple();
        seen |= 4;
      } else {
        fail(fmt::format("its header has an unknown entry '{}'", key.substr(0, 40)));
      }
      if (!accept(',')) {
        expect('}');
        break;
      }
    }
    if (seen != 7) fail("its header lacks descr, fortran_order or shape");
    return header;
  }

 private:
  std::string quoted() {
    skip_space();
    if (text_.empty() || (text_.front() != '\'' && text_.front() != '"'))
      fail("its header has no text in quotes where one belongs (records are not supported)");
    const char quote = text_.front();
    const size_t end = text_.find(quote, 1);
    if (end == std::string_view::npos) fail("its header has an open quote");
    std::string content(text_.substr(1, end - 1));
    text_.remove_prefix(end + 1);
    return content;
  }
  bool boolean() {
    skip_space();
    for (const auto& [word, value] : {std::pair<std::string_view, bool>{"True", true}, {"False", false}}) {
      if (!text_.starts_with(word)) continue;
      text_.remove_prefix(word.size());
      return value;
    }
    fail("its fortran_order is neither True nor False");
  }
  std::vector<int64_t> tuple() {
    std::vector<int64_t> values;
    expect('(');
    while (!accept(')')) {
      const std::optional<int64_t> value = size();
      if (!value || values.size() == most_axes) fail("its shape is not a list of sizes");
      values.push_back(*value);
      if (!accept(',')) {
        expect(')');
        break;
      }
    }
    return values;
  }
};

template <class Number>
double number_at(const char* bytes, bool swap) {
  std::array<char, sizeof(Number)> buffer;
  for (size_t i = 0; i < buffer.size(); ++i) buffer[i] = bytes[swap ? buffer.size() - 1 - i : i];
  return static_cast<double>(std::bit_cast<Number>(buffer));
}

using ReadNumber = double (*)(const char*, bool);
struct Type {
  ReadNumber read;
  size_t size;
  bool swap;
};

/// Numbers of one byte have the byte order '|'. A truth value is 0 or 1.
std::optional<Type> find_type(std::string_view name) {
  if (name.size() != 3 || std::string_view("<>=|").find(name[0]) == std::string_view::npos) return std::nullopt;
  const std::string_view kind = name.substr(1);
  const bool swap = name[0] == '>';
  if (kind == "b1" || kind == "u1") return Type{number_at<uint8_t>, 1, false};
  if (kind == "i1") return Type{number_at<int8_t>, 1, false};
  if (name[0] == '|') return std::nullopt;
  if (kind == "f8") return Type{number_at<double>, 8, swap};
  if (kind == "f4") return Type{number_at<float>, 4, swap};
  if (kind == "i8") return Type{number_at<int64_t>, 8, swap};
  if (kind == "i4") return Type{number_at<int32_t>, 4, swap};
  if (kind == "i2") return Type{number_at<int16_t>, 2, swap};
  if (kind == "u8") return Type{number_at<uint64_t>, 8, swap};
  if (kind == "u4") return Type{number_at<uint32_t>, 4, swap};
  if (kind == "u2") return Type{number_at<uint16_t>, 2, swap};
  return std::nullopt;
}

/// Number of elements; nullopt if it is larger than `most`.
std::optional<size_t> count_of(const std::vector<int64_t>& shape, size_t most) {
  size_t count = 1;
  for (int64_t size : shape) {
    if (size == 0) return 0;
  }
  for (int64_t size : shape) {
    if (__builtin_mul_overflow(count, static_cast<size_t>(size), &count) || count > most) return std::nullopt;
  }
  return count;
}

/// Reorders elements from Fortran order to C order.
std::vector<double> from_fortran_order(const std::vector<double>& values, const std::vector<int64_t>& shape) {
  std::vector<double> result(values.size());
  std::vector<size_t> stride(shape.size(), 1), place(shape.size(), 0);
  for (size_t a = shape.size(); a-- > 1;) stride[a - 1] = stride[a] * static_cast<size_t>(shape[a]);
  size_t to = 0;
  for (double value : values) {
    result[to] = value;
    for (size_t a = 0; a < shape.size(); ++a) {
      to += stride[a];
      if (++place[a] < static_cast<size_t>(shape[a])) break;
      to -= stride[a] * static_cast<size_t>(shape[a]);
      place[a] = 0;
    }
  }
  return result;
}

std::string header_of(std::span<const int64_t> shape, bool is_single) {
  std::string text = fmt::format("{{'descr': '<f{}', 'fortran_order': False, 'shape': ({}{}), }}", is_single ? 4 : 8,
                                 fmt::join(shape, ", "), shape.size() == 1 ? "," : "");
  const size_t before = magic.size() + 4;
  text.append(63 - (before + text.size()) % 64, ' ');
  text += '\n';
  std::string header(magic);
  header += {'\x01', '\x00', static_cast<char>(text.size() & 0xff), static_cast<char>(text.size() >> 8)};
  return header + text;
}

}  // namespace

NpyArray parse_npy(std::span<const char> bytes, const std::string& name) {
  const std::string_view all(bytes.data(), bytes.size());
  NpyHeaderReader reader({}, name);
  if (!all.starts_with(magic)) reader.fail("it does not begin with the bytes of one");
  if (all.size() < magic.size() + 4) reader.fail("it ends inside its header");
  const int version = all[6];
  if (version < 1 || version > 3) reader.fail(fmt::format("its format version {} is not 1, 2 or 3", version));
  const size_t digits = version == 1 ? 2 : 4, start = magic.size() + 2 + digits;
  if (all.size() < start) reader.fail("it ends inside its header");
  size_t length = 0;
  for (size_t i = digits; i-- > 0;) length = length << 8 | static_cast<unsigned char>(all[magic.size() + 2 + i]);
  if (length > all.size() - start) reader.fail("it ends inside its header");
  const Header header = NpyHeaderReader(all.substr(start, length), name).read();
  const std::optional<Type> type = find_type(header.type);
  if (!type)
    reader.fail(fmt::format("its numbers are of type '{}'; float64, float32, integers and truth values are supported",
                            header.type.substr(0, 40)));
  const std::string_view data = all.substr(start + length);
  const std::optional<size_t> count = count_of(header.shape, data.size() / type->size);
  if (!count)
    reader.fail(
        fmt::format("{} bytes of numbers are too few for its shape ({})", data.size(), fmt::join(header.shape, ", ")));
  if (*count * type->size != data.size())
    reader.fail(fmt::format("{} bytes follow the numbers of its shape ({})", data.size() - *count * type->size,
                            fmt::join(header.shape, ", ")));
  NpyArray array{header.shape, std::vector<double>(*count)};
  for (size_t i = 0; i < *count; ++i) array.values[i] = type->read(data.data() + i * type->size, type->swap);
  if (header.fortran_order && header.shape.size() > 1) array.values = from_fortran_order(array.values, header.shape);
  return array;
}

NpyArray read_npy(const std::filesystem::path& path) { return parse_npy(read_file(path), path.string()); }

namespace {

void must_have(std::span<const int64_t> shape, size_t values) {
  const std::optional<size_t> count = count_of({shape.begin(), shape.end()}, values);
  if (!count || *count != values)
    throw Error(ErrorKind::input, fmt::format("{} values do not have the shape ({})", values, fmt::join(shape, ", ")));
}

std::string_view bytes_of(std::span<const double> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

}  // namespace

std::string compose_npy(std::span<const int64_t> shape, std::span<const double> values, bool is_single) {
  must_have(shape, values.size());
  std::string bytes = header_of(shape, is_single);
  if (!is_single) return bytes.append(bytes_of(values));
  const std::vector<float> rounded(values.begin(), values.end());
  return bytes.append(reinterpret_cast<const char*>(rounded.data()), rounded.size() * sizeof(float));
}

void write_npy(const std::filesystem::path& path, std::span<const int64_t> shape, std::span<const double> values) {
  must_have(shape, values.size());
  write_file_atomically(path, {header_of(shape, false), bytes_of(values)});
}

void write_npy(const std::filesystem::path& path, std::span<const int64_t> shape, int64_t count,
               const std::function<std::vector<double>(int64_t)>& part) {
  AtomicFile file(path);
  file.append(header_of(shape, false));
  size_t values = 0;
  for (int64_t k = 0; k < count; ++k) {
    const std::vector<double> next = part(k);
    file.append(bytes_of(next));
    values += next.size();
  }
  must_have(shape, values);
  file.finish();
}

}  // namespace dpde
