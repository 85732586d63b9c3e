#pragma once
// The Ethernet configuration and the messages of KUKA's public RSI client, as they go over the wire.
#include <string>

#include "client_lib/gateway/rsi/configuration.h"

namespace takt::test {

inline const std::string kRsiXml = R"(<ROOT>
  <CONFIG>
    <IP_NUMBER>127.0.0.1</IP_NUMBER>
    <PORT>59152</PORT>
    <SENTYPE>KROSHU</SENTYPE>
    <ONLYSEND>FALSE</ONLYSEND>
  </CONFIG>
  <SEND>
    <ELEMENTS>
      <ELEMENT TAG="DEF_RIst"  TYPE="DOUBLE" INDX="INTERNAL" />
      <ELEMENT TAG="DEF_AIPos" TYPE="DOUBLE" INDX="INTERNAL" />
      <ELEMENT TAG="DEF_EIPos" TYPE="DOUBLE" INDX="INTERNAL" />
      <ELEMENT TAG="DEF_Delay" TYPE="LONG"   INDX="INTERNAL" />
    </ELEMENTS>
  </SEND>
  <RECEIVE>
    <ELEMENTS>
      <ELEMENT TAG="Stop"  TYPE="BOOL"   INDX="1" HOLDON="0" />
      <ELEMENT TAG="AK.A1" TYPE="DOUBLE" INDX="2" HOLDON="1" />
      <ELEMENT TAG="AK.A2" TYPE="DOUBLE" INDX="3" HOLDON="1" />
      <ELEMENT TAG="AK.A3" TYPE="DOUBLE" INDX="4" HOLDON="1" />
      <ELEMENT TAG="AK.A4" TYPE="DOUBLE" INDX="5" HOLDON="1" />
      <ELEMENT TAG="AK.A5" TYPE="DOUBLE" INDX="6" HOLDON="1" />
      <ELEMENT TAG="AK.A6" TYPE="DOUBLE" INDX="7" HOLDON="1" />
    </ELEMENTS>
  </RECEIVE>
</ROOT>
)";

/// Every `from` replaced.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

inline gateway::rsi::Configuration rsi_configuration(const std::string& xml = kRsiXml) {
  return gateway::rsi::parse_configuration(xml, "rsi.xml");
}

inline const std::string kGoldenRob =
    R"(<Rob Type="KUKA"><RIst X="445.0" Y="0.0" Z="790.0" A="180.0" B="0.0" C="180.0"/>)"
    R"(<AIPos A1="0.0000" A2="-90.0000" A3="90.0000" A4="0.0000" A5="90.0000" A6="0.0000"/>)"
    R"(<EIPos E1="0.0" E2="0.0" E3="0.0" E4="0.0" E5="0.0" E6="0.0"/><Delay D="0"/><IPOC>4208163634</IPOC></Rob>)";
inline const std::string kGoldenSen =
    R"(<Sen Type="KROSHU"><Stop>0</Stop><AK A1="0.572958" A2="0.000000" A3="0.000000" A4="0.000000" A5="0.000000" )"
    R"(A6="0.000000"/><IPOC>4208163634</IPOC></Sen>)";

}  // namespace takt::test
