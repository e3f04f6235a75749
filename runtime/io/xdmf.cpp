// SPDX-License-Identifier: Apache-2.0
// XDMF 3 (www.xdmf.org): a rectilinear mesh from the faces of the cells; each state is a slice of a variable of the
// NetCDF-4 file, which is an HDF5 file.
#include "xdmf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace dpde {

namespace {

using Faces = std::array<std::vector<double>, 3>;

/// nz ny nx: the last one is the fastest.
std::string cells_text(const Faces& faces) {
  return fmt::format("{} {} {}", faces[2].size() - 1, faces[1].size() - 1, faces[0].size() - 1);
}

std::string mesh(const Faces& faces) {
  std::string text = fmt::format(
      "        <Topology TopologyType=\"3DRectMesh\" NumberOfElements=\"{} {} {}\"/>\n        <Geometry "
      "GeometryType=\"VXVYVZ\">\n",
      faces[2].size(), faces[1].size(), faces[0].size());
  for (const std::vector<double>& along : faces) {
    text += fmt::format(
        "          <DataItem Format=\"XML\" NumberType=\"Float\" Precision=\"8\" "
        "Dimensions=\"{}\">{}</DataItem>\n",
        along.size(), fmt::join(along, " "));
  }
  return text + "        </Geometry>\n";
}

std::string attribute(const std::string& file, const std::string& field, const Faces& faces, bool is_single,
                      std::size_t state, std::size_t states) {
  const std::string cells = cells_text(faces);
  return fmt::format(
      "        <Attribute Name=\"{0}\" Center=\"Cell\" AttributeType=\"Scalar\">\n"
      "          <DataItem ItemType=\"HyperSlab\" Dimensions=\"{1}\">\n"
      "            <DataItem Format=\"XML\" Dimensions=\"3 4\">{2} 0 0 0 1 1 1 1 1 {1}</DataItem>\n"
      "            <DataItem Format=\"HDF\" NumberType=\"Float\" Precision=\"{3}\" "
      "Dimensions=\"{4} {1}\">{5}:/{0}</DataItem>\n"
      "          </DataItem>\n        </Attribute>\n",
      field, cells, state, is_single ? 4 : 8, states, file);
}

}  // namespace

std::string xdmf_text(const std::string& file, const Faces& faces, bool is_single, const std::vector<XdmfSeries>& all) {
  std::string text = "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n";
  for (const XdmfSeries& series : all) {
    text += "    <Grid Name=\"states\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
    for (std::size_t k = 0; k < series.times.size(); ++k) {
      text += fmt::format("      <Grid Name=\"state {}\" GridType=\"Uniform\">\n        <Time Value=\"{}\"/>\n", k,
                          series.times[k]);
      text += mesh(faces);
      for (const std::string& field : series.fields)
        text += attribute(file, field, faces, is_single, k, series.times.size());
      text += "      </Grid>\n";
    }
    text += "    </Grid>\n";
  }
  return text + "  </Domain>\n</Xdmf>\n";
}

}  // namespace dpde
