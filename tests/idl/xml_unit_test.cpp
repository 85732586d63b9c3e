#include "idl/common/xml.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

TEST(Xml, CharactersWithAMeaningAreReferencesAndLinesStay) {
  EXPECT_EQ(xml_content("a < b && \"c\" > d\n\te\x01"), "a &lt; b &amp;&amp; \"c\" &gt; d\n\te ");
  EXPECT_EQ(xml_escaped("a < b && \"c\" > d\n\te\x01"), "a &lt; b &amp;&amp; &quot;c&quot; &gt; d\n\te ");
}

}  // namespace
}  // namespace takt
