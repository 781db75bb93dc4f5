# Puts VERSION and a hash of files into a text: cmake -DVERSION= -DFILES=a.h;b.h -DIN= -DOUT= -P HashOfFiles.cmake
set(texts "")
foreach(file ${FILES})
  file(SHA256 ${file} hash)
  string(APPEND texts ${hash})
endforeach()
string(SHA256 HASH "${texts}")
string(SUBSTRING ${HASH} 0 12 HASH)
configure_file(${IN} ${OUT} @ONLY)
