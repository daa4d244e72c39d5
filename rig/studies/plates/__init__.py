"""Plates and shells against closed forms, independent codes and finer meshes."""
