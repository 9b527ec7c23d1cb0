! SPDX-License-Identifier: MIT
!> Records of ground motion and tables of a session, read as the program reads them.
module rockdda_python_tables
   use rockdda_model_quake_options, only : form_of
   use rockdda_io_record_file, only : read_record
   use rockdda_io_separators, only : settle_separators
   use rockdda_io_source, only : read_source
   use rockdda_python_session, only : session_type
   implicit none
   private
   public :: read_motion_of_file, read_plain_table

contains

   !> Read a record.
   subroutine read_motion_of_file(session, path, form, column, has_scale)
      type(session_type), intent(inout) :: session
      character(len=*), intent(in) :: path, form         !! form: 'csv', 'at2', or empty: by the ending
      character(len=*), intent(in) :: column             !! empty: the second
      logical, intent(in) :: has_scale                   !! a factor of the values is given
      call read_record(path, form_of(form, path), column, has_scale, session%motion, session%motion_unit, &
                       session%messages)
   end subroutine read_motion_of_file

   !> Read a table and make its separators plain.
   subroutine read_plain_table(session, path, least, multiple)
      type(session_type), intent(inout) :: session
      character(len=*), intent(in) :: path
      integer, intent(in) :: least, multiple             !! numbers of a row
      logical :: ok
      call read_source(path, session%table, session%messages, ok)
      if (ok) call settle_separators(session%table, least, multiple, session%messages, ok)
   end subroutine read_plain_table

end module rockdda_python_tables
