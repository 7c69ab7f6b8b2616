"""The archive: traces in storage that speaks S3, behind the folder of traces."""
