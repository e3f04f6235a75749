// SPDX-License-Identifier: Apache-2.0
// The cache of compiled code as users see it: its location, unchanged results, and safety against manipulated entries.
#include "command_support.h"

namespace dpde::testing {
namespace {

class Cache : public Command {
 protected:
  Json run(const std::string& options, const std::string& before = "") const {
    write("rod.dpde", rod_text);
    const Outcome outcome = shell(before + " $DPDE run rod.dpde rod --json " + options);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.json();
  }
  std::vector<fs::path> entries(const std::string& folder) const {
    std::vector<fs::path> found;
    if (!fs::exists(path(folder))) return found;
    for (const auto& entry : fs::directory_iterator(path(folder))) found.push_back(entry.path());
    return found;
  }
};

TEST_F(Cache, TheSecondRunTakesTheCodeOfTheFirst) {
  for (const std::string backend : {"jit", "cpp"}) {
    const std::string options = "--cache c --backend " + backend;
    const Json first = run(options + " --out o1"), second = run(options + " --out o2");
    EXPECT_FALSE(first["code_from_cache"].get<bool>());
    EXPECT_TRUE(second["code_from_cache"].get<bool>()) << backend;
    EXPECT_EQ(content(path("o1/u.npy")), content(path("o2/u.npy")));
  }
  EXPECT_EQ(entries("c").size(), 2u);
}

TEST_F(Cache, NoneWhenToldSo) {
  run("--cache c");
  EXPECT_FALSE(run("--cache c --no-cache")["code_from_cache"].get<bool>());
  EXPECT_TRUE(run("--cache c")["code_from_cache"].get<bool>());
}

TEST_F(Cache, LivesWhereTheEnvironmentSays) {
  run("", "DPDE_CACHE=own");
  EXPECT_EQ(entries("own").size(), 1u);
  run("", "unset DPDE_CACHE; XDG_CACHE_HOME=$PWD/xdg");
  EXPECT_EQ(entries("xdg/dpde").size(), 1u);
  run("", "unset DPDE_CACHE XDG_CACHE_HOME; HOME=$PWD/home");
  EXPECT_EQ(entries("home/.cache/dpde").size(), 1u);
  run("", "unset DPDE_CACHE XDG_CACHE_HOME HOME;");
  run("", "DPDE_CACHE=/proc/nothing");  // a missing cache is no failure
}

TEST_F(Cache, AFolderThatCannotBeMadeIsAnErrorWhereItWasAskedFor) {
  write("rod.dpde", rod_text);
  const Outcome outcome = dpde("run rod.dpde rod --json --cache /proc/nothing");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0902"});
}

TEST_F(Cache, DamagedEntriesAreMadeAnew) {
  for (const std::string backend : {"jit", "cpp"}) {
    const std::string options = "--cache c --backend " + backend;
    run(options + " --out good");
    for (const fs::path& entry : entries("c")) {
      std::string bytes = content(entry);
      for (std::size_t i = bytes.size() / 2; i < bytes.size(); i += 7) bytes[i] = '?';
      std::ofstream(entry, std::ios::binary) << bytes;
    }
    EXPECT_FALSE(run(options + " --out bad")["code_from_cache"].get<bool>());
    EXPECT_EQ(content(path("good/u.npy")), content(path("bad/u.npy")));
    EXPECT_TRUE(run(options)["code_from_cache"].get<bool>());
  }
}

TEST_F(Cache, CertificatesOfGradientsAreKeptBesideTheCode) {
  write("rod.dpde", rod_text);
  const auto certificate = [&](const std::string& verb, const std::string& options) {
    const Outcome outcome = dpde(verb + " rod.dpde find --json --cache c " + options);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.json()["certificate"];
  };
  EXPECT_TRUE(certificate("gradient", "--no-certify").is_null());
  const Json first = certificate("gradient", "--certify"), second = certificate("optimize", "");
  EXPECT_LT(first["dot_product"].get<double>(), 1e-12);
  EXPECT_FALSE(first["from_cache"].get<bool>());
  EXPECT_EQ(first["run"]["unknown"], "k");
  EXPECT_LT(first["run"]["quotient_error"].get<double>(), 1e-6);
  EXPECT_TRUE(first["left_out"].empty()) << first;
  EXPECT_EQ(second["run"], first["run"]);
  EXPECT_TRUE(second["from_cache"].get<bool>());
  EXPECT_EQ(second["dot_product"], first["dot_product"]);
  for (const fs::path& entry : entries("c")) std::ofstream(entry, std::ios::binary | std::ios::app) << "more";
  EXPECT_FALSE(certificate("optimize", "--certify")["from_cache"].get<bool>());
  EXPECT_TRUE(certificate("gradient", "")["from_cache"].get<bool>());
  EXPECT_EQ(dpde("gradient rod.dpde find --certify --no-certify").status, 2);
}

TEST_F(Cache, ChangedSourceIsNewCode) {
  run("--cache c");
  EXPECT_TRUE(run("--cache c --set k=0.1 --set cells=32 --set step=1/64")["code_from_cache"]
                  .get<bool>());  // numbers of the run
  EXPECT_FALSE(run("--cache c --set time=rk2")["code_from_cache"].get<bool>());
}

TEST_F(Cache, AFullDiskIsNoReasonToFail) {
  write("rod.dpde", rod_text);
  const Outcome outcome = shell("trap '' XFSZ; ulimit -f 1; $DPDE run rod.dpde rod --quiet --cache c");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_TRUE(entries("c").empty());
}

TEST_F(Cache, SeveralRunsAtOnce) {
  write("rod.dpde", rod_text);
  const Outcome outcome = shell(
      "for i in 1 2 3 4; do $DPDE run rod.dpde rod --quiet --cache c --out o$i & done; wait; "
      "for i in 2 3 4; do cmp o1/u.npy o$i/u.npy || exit 1; done");
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  EXPECT_EQ(entries("c").size(), 1u);
}

/// Cached code is executed: anyone who can write to the folder, a parent folder or an entry could insert code.
TEST_F(Cache, WhatOthersMayWriteToIsNotUsed) {
  write("rod.dpde", rod_text);
  const auto codes = [&](const std::string& before, const std::string& folder) {
    const Outcome outcome = shell(before + " && $DPDE run rod.dpde rod --json --cache " + folder);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.codes();
  };
  const std::vector<std::string> none, refused{"W0903"};
  EXPECT_EQ(codes("mkdir own && chmod 755 own", "own"), none);
  for (const std::string mode : {"775", "757", "1777"}) {
    EXPECT_EQ(codes("mkdir m" + mode + " && chmod " + mode + " m" + mode, "m" + mode), refused);
    EXPECT_TRUE(entries("m" + mode).empty());
  }
  EXPECT_EQ(codes("mkdir -p open/c && chmod 700 open/c && chmod 777 open", "open/c"), refused);
  EXPECT_EQ(codes("mkdir -p sticky/c && chmod 700 sticky/c && chmod 1777 sticky", "sticky/c"), none);
  for (const fs::path& entry : entries("own"))
    EXPECT_EQ(fs::status(entry).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_TRUE(run("--cache own")["code_from_cache"].get<bool>());
  for (const std::string change :
       {"chmod 660 own/*", "chmod 606 own/*", "for f in own/*; do mv $f e; ln -s $PWD/e $f; done"}) {
    shell(change);
    EXPECT_FALSE(run("--cache own")["code_from_cache"].get<bool>()) << change;
    EXPECT_TRUE(run("--cache own")["code_from_cache"].get<bool>()) << change;
  }
}

}  // namespace
}  // namespace dpde::testing
