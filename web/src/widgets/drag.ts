// The data type of a field that is dragged from the list of channels onto a plot.
export const kDragType = "text/ruedo-field";
