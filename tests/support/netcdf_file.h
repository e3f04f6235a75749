// SPDX-License-Identifier: Apache-2.0
// Reads and writes NetCDF files with the C library only, independently of dpde's reader and writer.
#pragma once

#include <gtest/gtest.h>
#include <netcdf.h>

#include <string>
#include <utility>
#include <vector>

namespace dpde::testing {

class NetcdfFile {
 public:
  explicit NetcdfFile(const std::string& path) { EXPECT_EQ(nc_open(path.c_str(), NC_NOWRITE, &id_), NC_NOERR) << path; }
  ~NetcdfFile() { nc_close(id_); }
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  std::vector<std::string> dimensions(const std::string& variable) const {
    const auto [group, number] = place(variable);
    int rank = 0;
    nc_inq_varndims(group, number, &rank);
    std::vector<int> ids(static_cast<std::size_t>(rank));
    nc_inq_vardimid(group, number, ids.data());
    std::vector<std::string> names;
    for (const int id : ids) {
      char name[NC_MAX_NAME + 1] = "";
      nc_inq_dimname(group, id, name);
      names.push_back(name);
    }
    return names;
  }
  std::vector<double> values(const std::string& variable) const {
    const auto [group, number] = place(variable);
    int rank = 0;
    nc_inq_varndims(group, number, &rank);
    std::vector<int> ids(static_cast<std::size_t>(rank));
    nc_inq_vardimid(group, number, ids.data());
    std::size_t count = 1;
    for (const int id : ids) {
      std::size_t length = 0;
      nc_inq_dimlen(group, id, &length);
      count *= length;
    }
    std::vector<double> values(count);
    EXPECT_EQ(nc_get_var_double(group, number, values.data()), NC_NOERR);
    return values;
  }
  bool is_float(const std::string& variable) const {
    const auto [group, number] = place(variable);
    nc_type type = 0;
    nc_inq_vartype(group, number, &type);
    return type == NC_FLOAT;
  }
  /// Of a variable, or of the file (variable ""); "" if there is none.
  std::string text(const std::string& variable, const std::string& attribute) const {
    const auto [group, number] = variable.empty() ? std::pair(id_, NC_GLOBAL) : place(variable);
    std::size_t length = 0;
    if (nc_inq_attlen(group, number, attribute.c_str(), &length) != NC_NOERR) return "";
    std::string value(length, '\0');
    nc_get_att_text(group, number, attribute.c_str(), value.data());
    return value;
  }

 private:
  /// In the file itself, or in its group of numbers.
  std::pair<int, int> place(const std::string& variable) const {
    int group = id_, number = -1;
    if (nc_inq_varid(id_, variable.c_str(), &number) == NC_NOERR) return {id_, number};
    EXPECT_EQ(nc_inq_grp_ncid(id_, "numbers", &group), NC_NOERR) << variable;
    EXPECT_EQ(nc_inq_varid(group, variable.c_str(), &number), NC_NOERR) << variable;
    return {group, number};
  }
  int id_ = -1;
};

}  // namespace dpde::testing
