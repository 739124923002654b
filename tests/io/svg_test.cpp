#include <string>

#include <gtest/gtest.h>

#include "io/svg.hpp"

namespace flyball::io::svg_test {
namespace {

TEST(PlainSvg, DrawsAndDoesNothingElse) {
  const auto with = [](const std::string& inside) {
    return "<svg width=\"9\">" + inside + "</svg>\n";
  };
  for (const char* good :
       {"", "<path d='M0,0 h2'/>", "<g id=\"a\"><text>a &lt; b</text></g>",
        "<use xlink:href='#a'/>", "<image href=\"data:image/png;base64,AAAA\"/>",
        "<g clip-path=\"url(#c)\"></g >", "<title>x > y</title>", "<rect\n x = '1'\ty='2' />"}) {
    EXPECT_TRUE(is_plain_svg(with(good))) << good;
  }
  for (const char* bad : {"<script>alert(1)</script>",
                          "<g onload=\"alert(1)\"/>",
                          "<g OnClick='a'/>",
                          "<a xlink:href='#a'/>",
                          "<use href=\"http://x/y#z\"/>",
                          "<image href='x.png'/>",
                          "<g style=\"fill:url(http://x)\"/>",
                          "<g fill='url(http://x)'/>",
                          "<foreignObject/>",
                          "</svg><div>",
                          "</g>",
                          "<g>",
                          "<g></path>",
                          "<!-- c -->",
                          "<![CDATA[x]]>",
                          "<?php ?>",
                          "<svg></svg>",
                          "<g a=b/>",
                          "<g a/>",
                          "<g a='b/>",
                          "<SCRIPT/>",
                          "\xFF",
                          "<g a='<'/>"}) {
    EXPECT_FALSE(is_plain_svg(with(bad))) << bad;
  }
  for (const char* bad : {"", "no picture", "<g/>", "<svg", "<svg></svg>x", "x<svg></svg>",
                          "<svg></svg><svg></svg>", "<svg><g>"}) {
    EXPECT_FALSE(is_plain_svg(bad)) << bad;
  }
  EXPECT_TRUE(is_plain_svg("<svg/>"));
}

}  // namespace
}  // namespace flyball::io::svg_test
