# Writes ruedo/plugin_abi.h: cmake -DVERSION= -DHEADERS=a.h;b.h -DIN= -DOUT= -P PluginAbi.cmake
set(texts "")
foreach(header ${HEADERS})
  file(SHA256 ${header} hash)
  string(APPEND texts ${hash})
endforeach()
string(SHA256 HASH "${texts}")
string(SUBSTRING ${HASH} 0 12 HASH)
configure_file(${IN} ${OUT} @ONLY)
