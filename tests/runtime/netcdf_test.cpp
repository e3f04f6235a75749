// SPDX-License-Identifier: Apache-2.0
// NetCDF files: round trips, also through the C library; files of other programs; damaged files.
#include "dpde/runtime/netcdf.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "dpde/runtime/error.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

namespace fs = std::filesystem;

NetcdfContent sample() {
  NetcdfContent content;
  content.dimensions = {{"time", 2}, {"x", 3}};
  content.attributes = {{"title", "a run"}, {"seed", 7.0}};
  content.variables = {{"time", {"time"}, {{"axis", "T"}}, {0, 0.5}},
                       {"u", {"time", "x"}, {{"units", "1"}}, {1, 2, 3, 4, 5, 1e300}},
                       {"nu", {}, {}, {0.25}}};
  return content;
}

class NetcdfTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("nc_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path() const { return (folder_ / "file.nc").string(); }
  std::string write(const std::string& bytes) const {
    std::ofstream(path(), std::ios::binary) << bytes;
    return path();
  }
  std::string bytes() const {
    std::ifstream in(path(), std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }

 private:
  fs::path folder_;
};

TEST_F(NetcdfTest, TheCLibraryReadsWhatWasWritten) {
  const NetcdfFile file(write(compose_netcdf(sample())));
  EXPECT_EQ(file.dimensions("u"), (std::vector<std::string>{"time", "x"}));
  EXPECT_EQ(file.values("u"), (std::vector<double>{1, 2, 3, 4, 5, 1e300}));
  EXPECT_EQ(file.values("nu"), std::vector<double>{0.25});
  EXPECT_EQ(file.text("", "title"), "a run");
  EXPECT_EQ(file.text("time", "axis"), "T");
}

TEST_F(NetcdfTest, ReadsBackAllOrOneState) {
  const NetcdfReader reader(compose_netcdf(sample()), "f.nc");
  ASSERT_NE(reader.find("u"), nullptr);
  EXPECT_EQ(reader.find("u")->shape, (std::vector<std::int64_t>{2, 3}));
  EXPECT_EQ(reader.read(*reader.find("u")), (std::vector<double>{1, 2, 3, 4, 5, 1e300}));
  EXPECT_EQ(reader.read(*reader.find("u"), 1), (std::vector<double>{4, 5, 1e300}));
  EXPECT_EQ(reader.read(*reader.find("nu")), std::vector<double>{0.25});
  EXPECT_EQ(reader.text("u", "units"), "1");
  EXPECT_EQ(reader.text("u", "nothing"), std::nullopt);
  EXPECT_EQ(reader.find("v"), nullptr);
}

TEST_F(NetcdfTest, EqualContentGivesEqualBytes) { EXPECT_EQ(compose_netcdf(sample()), compose_netcdf(sample())); }

/// Few values, and many, which are compressed; several times in one chunk, and several chunks per time.
TEST_F(NetcdfTest, PartsAreWhatAllIsAtOnce) {
  for (const auto& [instants, cells] : {std::pair<int, int>{3, 5}, {1, 5000}, {7, 90000}, {2, 300000}}) {
    const auto values = [&, n = cells](std::int64_t first, std::int64_t count) {
      std::vector<double> all;
      for (std::int64_t i = first * n; i < (first + count) * n; ++i) all.push_back(std::sin(0.1 * double(i)));
      return all;
    };
    const auto content = [&, n = cells, k = instants](bool in_parts) {
      NetcdfContent result = sample();
      result.dimensions = {{"time", k}, {"x", n}};
      result.variables[0].values.assign(std::size_t(k), 0.5);
      result.variables[1].values.clear();
      result.variables[1].is_single = n == 90000;
      if (in_parts) result.variables[1].part = values;
      if (!in_parts) result.variables[1].values = values(0, k);
      return result;
    };
    EXPECT_EQ(compose_netcdf(content(true)), compose_netcdf(content(false)));
    write_netcdf(path(), content(true));
    const NetcdfReader whole(compose_netcdf(content(false)), "memory"), file(bytes(), "file");
    ASSERT_EQ(file.variables().size(), whole.variables().size());
    for (const auto& variable : whole.variables())
      EXPECT_EQ(file.read(*file.find(variable.name)), whole.read(variable)) << variable.name;
    EXPECT_EQ(file.text("u", "units"), "1");
    std::string damaged = bytes();
    damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
    EXPECT_THROW(NetcdfReader(damaged, "bad.nc"), Error);
  }
}

TEST_F(NetcdfTest, AFileThatFailsIsNotThere) {
  NetcdfContent content = sample();
  content.variables[1].part = [](std::int64_t, std::int64_t) -> std::vector<double> {
    throw Error(ErrorKind::machine, "no such state");
  };
  EXPECT_THROW(write_netcdf(path(), content), Error);
  EXPECT_TRUE(fs::is_empty(fs::path(path()).parent_path()));
  EXPECT_THROW(write_netcdf(path() + "/below/f.nc", sample()), Error);
}

TEST_F(NetcdfTest, LongTextsSurvive) {
  NetcdfContent content = sample();
  const std::string text(3000000, 'x');
  content.attributes.push_back({"long", text});
  EXPECT_EQ(NetcdfReader(compose_netcdf(content), "f.nc").text("", "long"), text);
}

/// Classic format, single precision, packed, with missing values.
TEST_F(NetcdfTest, ReadsPackedClassicFiles) {
  int id = 0, x = 0, packed = 0, label = 0;
  ASSERT_EQ(nc_create(path().c_str(), NC_CLOBBER, &id), NC_NOERR);
  nc_def_dim(id, "x", 3, &x);
  nc_def_var(id, "p", NC_SHORT, 1, &x, &packed);
  nc_def_var(id, "label", NC_CHAR, 1, &x, &label);
  const double scale = 0.5, offset = 10;
  const short missing = -1, values[] = {2, -1, 4};
  nc_put_att_double(id, packed, "scale_factor", NC_DOUBLE, 1, &scale);
  nc_put_att_double(id, packed, "add_offset", NC_DOUBLE, 1, &offset);
  nc_put_att_short(id, packed, "_FillValue", NC_SHORT, 1, &missing);
  nc_enddef(id);
  nc_put_var_short(id, packed, values);
  ASSERT_EQ(nc_close(id), NC_NOERR);
  const NetcdfReader reader(bytes(), "p.nc");
  EXPECT_EQ(reader.find("label"), nullptr);
  const std::vector<double> p = reader.read(*reader.find("p"));
  EXPECT_EQ(p[0], 11);
  EXPECT_TRUE(std::isnan(p[1]));
  EXPECT_EQ(p[2], 12);
}

TEST_F(NetcdfTest, FindsEveryChangedByte) {
  const std::string whole = compose_netcdf(sample());
  for (std::size_t place = 0; place + 16 < whole.size(); place += 13) {
    std::string bytes = whole;
    bytes[place] = static_cast<char>(bytes[place] ^ 1);
    EXPECT_THROW(NetcdfReader(bytes, "bad.nc"), Error) << place;
  }
}

TEST_F(NetcdfTest, NamesDamagedFiles) {
  const std::string whole = compose_netcdf(sample());
  for (const std::string& bytes :
       {std::string(), std::string("CDF"), std::string(100, 'x'), whole.substr(0, whole.size() / 2)}) {
    try {
      const NetcdfReader reader(bytes, "bad.nc");
      for (const auto& variable : reader.variables()) reader.read(variable);
      ADD_FAILURE() << "read " << bytes.size() << " bytes";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_NE(std::string(error.what()).find("bad.nc"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace dpde::testing
