// SPDX-License-Identifier: Apache-2.0
// The .npz format: a zip archive with one .npy file for each array. Entries are stored, not compressed.
// https://pkware.cachefly.net/webdocs/casestudies/APPNOTE.TXT
//
// Nothing in the file is trusted: every length is compared with the actual size before anything is allocated.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/npy.h"
#include "files/weight_formats.h"

namespace dpde {
namespace {

constexpr std::string_view local_mark = "PK\x03\x04", central_mark = "PK\x01\x02", end_mark = "PK\x05\x06";
constexpr std::size_t local_bytes = 30, central_bytes = 46, end_bytes = 22, longest_comment = 65535;
constexpr uint32_t not_here = 0xffffffff;  // the number needs more than 32 bits and is in an extra field

[[noreturn]] void fail(const std::string& file, std::string_view what) {
  throw Error(ErrorKind::input, fmt::format("{} is not a usable .npz file: {}", file, what));
}

uint32_t number_at(std::string_view bytes, std::size_t at, int count) {
  uint32_t number = 0;
  for (int i = count; i-- > 0;)
    number = number << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  return number;
}

void append(std::string& bytes, uint64_t number, int count) {
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(i < 8 ? number >> (8 * i) & 0xff : 0);
}

std::array<uint32_t, 256> crc_table() {
  std::array<uint32_t, 256> table{};
  for (uint32_t i = 0; i < 256; ++i) {
    table[i] = i;
    for (int bit = 0; bit < 8; ++bit) table[i] = table[i] >> 1 ^ ((table[i] & 1) != 0 ? 0xedb88320U : 0U);
  }
  return table;
}

uint32_t crc_of(std::string_view bytes) {
  const std::array<uint32_t, 256> table = crc_table();
  uint32_t crc = not_here;
  for (const char c : bytes) crc = crc >> 8 ^ table[(crc ^ static_cast<unsigned char>(c)) & 0xff];
  return ~crc;
}

/// An entry of the central directory at the end of an archive.
struct Entry {
  std::string name;
  uint32_t method, crc, size, begin;
};

/// The entries of the directory, which starts at `at`.
std::vector<Entry> entries_of(std::string_view bytes, const std::string& file) {
  if (!bytes.starts_with(local_mark) && !bytes.starts_with(end_mark))
    fail(file, "it does not begin with the bytes of a zip archive");
  const std::size_t end = bytes.rfind(end_mark);
  if (end == std::string_view::npos || bytes.size() - end < end_bytes ||
      bytes.size() - end > end_bytes + longest_comment)
    fail(file, "its list of arrays is not there: the file was cut off");
  const uint32_t count = number_at(bytes, end + 10, 2);
  std::size_t at = number_at(bytes, end + 16, 4);
  std::vector<Entry> entries;
  for (uint32_t i = 0; i < count; ++i) {
    if (at > end || end - at < central_bytes || bytes.substr(at, 4) != central_mark)
      fail(file, "its list of arrays is damaged");
    const std::size_t name = number_at(bytes, at + 28, 2), extra = number_at(bytes, at + 30, 2),
                      comment = number_at(bytes, at + 32, 2);
    if (name + extra + comment > end - at - central_bytes) fail(file, "its list of arrays is damaged");
    entries.push_back({std::string(bytes.substr(at + central_bytes, name)), number_at(bytes, at + 10, 2),
                       number_at(bytes, at + 16, 4), number_at(bytes, at + 24, 4), number_at(bytes, at + 42, 4)});
    at += central_bytes + name + extra + comment;
  }
  return entries;
}

std::string_view content_of(std::string_view bytes, const Entry& entry, const std::string& file) {
  if (entry.method != 0)
    fail(file, fmt::format("{} is compressed; write it with numpy.savez, not savez_compressed", entry.name));
  if (entry.size == not_here || entry.begin == not_here) fail(file, fmt::format("{} is larger than 4 GiB", entry.name));
  if (entry.begin > bytes.size() || bytes.size() - entry.begin < local_bytes ||
      bytes.substr(entry.begin, 4) != local_mark)
    fail(file, fmt::format("{} is not where the list says", entry.name));
  const std::size_t start = local_bytes + number_at(bytes, entry.begin + 26, 2) + number_at(bytes, entry.begin + 28, 2);
  if (bytes.size() - entry.begin < start || bytes.size() - entry.begin - start < entry.size)
    fail(file, fmt::format("{} is cut off", entry.name));
  return bytes.substr(entry.begin + start, entry.size);
}

/// No byte may belong to two entries, so that arrays take no more memory than the file justifies.
void check_bytes_are_used_once(const std::vector<Entry>& entries, std::vector<std::string_view> contents,
                               const std::string& file) {
  std::ranges::sort(contents, {}, [](std::string_view content) { return content.data(); });
  for (std::size_t i = 1; i < contents.size(); ++i) {
    if (contents[i - 1].data() + contents[i - 1].size() <= contents[i].data()) continue;
    fail(file, fmt::format("some of its {} entries share their bytes", entries.size()));
  }
}

}  // namespace

std::vector<NamedArray> parse_npz(std::string_view bytes, const std::string& name) {
  std::vector<NamedArray> arrays;
  const std::vector<Entry> entries = entries_of(bytes, name);
  std::vector<std::string_view> contents;
  for (const Entry& entry : entries) {
    if (!entry.name.ends_with(".npy"))
      fail(name, fmt::format("it holds {}, which is no .npy", entry.name.substr(0, 80)));
    contents.push_back(content_of(bytes, entry, name));
  }
  check_bytes_are_used_once(entries, contents, name);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Entry& entry = entries[i];
    if (crc_of(contents[i]) != entry.crc)
      fail(name, fmt::format("{} is damaged: its checksum is another one", entry.name));
    NpyArray array = parse_npy(contents[i], fmt::format("{} in {}", entry.name, name));
    arrays.push_back({entry.name.substr(0, entry.name.size() - 4), std::move(array.shape), std::move(array.values)});
  }
  return arrays;
}

std::string compose_npz(std::span<const NamedArray> arrays, bool is_single) {
  std::string bytes, list;
  for (const NamedArray& array : arrays) {
    const std::string content = compose_npy(array.shape, array.values, is_single), name = array.name + ".npy";
    if (bytes.size() + content.size() > std::numeric_limits<uint32_t>::max() / 2)
      throw Error(ErrorKind::input, "arrays of more than 2 GiB need a .safetensors file");
    std::string common;  // version needed, flags, method, time, date (1980-01-01), checksum, sizes, length of the name,
                         // of extra fields
    for (const auto& [number, count] : {std::pair<uint64_t, int>{20, 2},
                                        {0, 2},
                                        {0, 2},
                                        {0, 2},
                                        {0x21, 2},
                                        {crc_of(content), 4},
                                        {content.size(), 4},
                                        {content.size(), 4},
                                        {name.size(), 2},
                                        {0, 2}}) {
      append(common, number, count);
    }
    list += std::string(central_mark) + std::string("\x14\0", 2) + common;
    append(list, 0, 10);  // length of the comment, disk, attributes inside and outside
    append(list, bytes.size(), 4);
    list += name;
    bytes += std::string(local_mark) + common + name + content;
  }
  const std::size_t begin = bytes.size();
  bytes += list + std::string(end_mark);
  append(bytes, 0, 4);  // disks
  append(bytes, arrays.size(), 2);
  append(bytes, arrays.size(), 2);
  append(bytes, list.size(), 4);
  append(bytes, begin, 4);
  append(bytes, 0, 2);
  return bytes;
}

}  // namespace dpde
